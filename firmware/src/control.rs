//! What the controller decides in one sample: its state, the motion it follows, the law that follows it, and what it trips on.
//!
//! [`controller`] joins the parts; each of the others is pure: [`states`] the states, [`laws`] the control laws, [`limits`] what
//! a motor can give, [`monitor`] what counts as a fault, [`fault`] what is done about it,
//! [`setup`] what can be changed meanwhile. [`phase`] is the probe that measures what each part costs. Leans on
//! [`mechanics`](crate::mechanics) and [`trajectory`](crate::trajectory).

/// Declares an enumeration and the list of its variants together, so that the list cannot miss one.
macro_rules! listed {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $($(#[$doc:meta])* $variant:ident,)+ }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($(#[$doc])* $variant,)+ }

        impl $name {
            /// Every variant, in the order of declaration.
            pub const ALL: [Self; [$(Self::$variant,)+].len()] = [$(Self::$variant,)+];
        }
    };
}

pub mod controller;
pub mod fault;
pub mod laws;
pub mod limits;
pub mod monitor;
pub mod phase;
pub mod self_test;
pub mod setup;
pub mod states;
