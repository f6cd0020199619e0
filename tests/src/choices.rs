//! Enumerations that random scenes choose from.

/// Defines an enumeration: `ALL` lists every choice; if the choices are grouped, a constant with the group's
/// name lists its choices.
macro_rules! choices {
    ($(#[$about:meta])* $name:ident {
        $($(#[$which:meta])* $group:ident { $($(#[$what:meta])* $choice:ident,)* })*
    }) => {
        choices! { $(#[$about])* $name { $($($(#[$what])* $choice,)*)* } }

        impl $name {
            $($(#[$which])* pub const $group: [Self; [$(Self::$choice),*].len()] = [$(Self::$choice),*];)*
        }
    };
    ($(#[$about:meta])* $name:ident { $($(#[$what:meta])* $choice:ident,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$what])* $choice,)* }

        impl $name {
            /// Every choice.
            pub const ALL: [Self; [$(Self::$choice),*].len()] = [$(Self::$choice),*];
        }
    };
}

pub(crate) use choices;
