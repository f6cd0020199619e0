//! What random scenes choose from.

/// An enumeration: `ALL` lists every choice, and the name of a group of choices, if there are groups, those of the group.
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
            /// All of them.
            pub const ALL: [Self; [$(Self::$choice),*].len()] = [$(Self::$choice),*];
        }
    };
}

pub(crate) use choices;
