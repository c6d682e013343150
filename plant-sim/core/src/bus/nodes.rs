//! Names of nodes.

/// A node of one bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(pub(super) usize);

/// Some nodes of one bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSet(u64);

impl NodeSet {
    /// Whether the node is one of them.
    #[must_use]
    pub fn contains(self, node: NodeId) -> bool {
        self.0 & 1 << node.0 != 0
    }

    /// The nodes, in the order they were attached.
    pub fn iter(self) -> impl Iterator<Item = NodeId> {
        (0..u64::BITS as usize)
            .map(NodeId)
            .filter(move |&node| self.contains(node))
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) fn insert(&mut self, node: usize) {
        self.0 |= 1 << node;
    }
}
