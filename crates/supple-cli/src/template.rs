//! Task templates for robots.

/// What the robot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Template {
    /// Press on a wall whose position is uncertain
    Press,
    /// Touch a wall and move along it under force
    Wipe,
    /// Insert into a hole of uncertain position
    Insert,
    /// Move a tool on a compliant mount to a point
    Reach,
    /// Keep pressing on a wall while it drifts and the joints are disturbed
    Hold,
    /// Open a door by its handle
    Handle,
}

impl Template {
    /// All templates, with names and descriptions.
    pub const ALL: [(Self, &'static str, &'static str); 6] = [
        (Self::Press, "press", "press on a wall whose position is uncertain"),
        (Self::Wipe, "wipe", "touch a wall and move along it under force"),
        (Self::Insert, "insert", "move along the wall of a hole that is not where it is expected"),
        (Self::Reach, "reach", "move a tool on a compliant mount to a point"),
        (Self::Hold, "hold", "keep pressing on a wall while it drifts and the joints are disturbed"),
        (Self::Handle, "handle", "open a door by its handle"),
    ];

    /// Its name and description.
    pub fn words(self) -> (&'static str, &'static str) {
        let found = Self::ALL.iter().find(|(template, _, _)| *template == self);
        found.map_or(("", ""), |(_, name, what)| (name, what))
    }

    /// Minimum number of joints: one to press, and another to move along the wall.
    pub fn joints(self) -> usize {
        match self {
            Self::Press | Self::Reach | Self::Hold => 1,
            Self::Wipe | Self::Insert | Self::Handle => 2,
        }
    }

    /// Which of the mount's axes are compliant: two lateral axes, then the pressing direction.
    pub fn yields(self) -> [bool; 3] {
        match self {
            Self::Insert => [true, true, false],
            Self::Reach | Self::Handle => [true; 3],
            Self::Press | Self::Wipe | Self::Hold => [false, false, true],
        }
    }

    /// Whether the tool touches a wall.
    pub fn touches(self) -> bool {
        matches!(self, Self::Press | Self::Wipe | Self::Insert | Self::Hold)
    }
}
