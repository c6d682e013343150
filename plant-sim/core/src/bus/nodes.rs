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
        let mut left = self.0;
        std::iter::from_fn(move || {
            let node = left.trailing_zeros();
            left &= left.checked_sub(1)?;
            Some(NodeId(node as usize))
        })
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
