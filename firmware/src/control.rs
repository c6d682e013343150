//! One sample of control: states, motion, control laws, limits and faults.
//!
//! [`controller`] joins the parts; each of the others is pure: [`readings`] what the drives report, [`states`] the
//! states, [`laws`] the control laws, [`limits`] what a motor can give, [`monitor`], [`chatter`], [`stance`] and [`heat`] what counts as a fault,
//! [`fault`] the reaction to it, [`setup`] what can be changed at run time. [`phase`] is the probe that measures what each part costs.
//! Depends on [`mechanics`](crate::mechanics) and [`trajectory`](crate::trajectory).

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

pub mod burden;
pub mod chatter;
pub mod controller;
pub mod fault;
pub mod heat;
pub mod laws;
pub mod limits;
pub mod monitor;
pub mod phase;
pub mod readings;
pub mod self_test;
pub mod setup;
pub mod stance;
pub mod states;
