//! Which values are in registers.

use super::assembler::{Assembler, Place, Register};

/// When a value is read next: the number of an instruction, or one of these.
pub(super) type Next = u32;

/// It is not read in this function any more, but afterwards.
pub(super) const AFTERWARDS: Next = u32::MAX - 1;

/// It is never read.
pub(super) const NEVER: Next = u32::MAX;

/// How many registers hold values of slots; the others are for intermediate results.
const COUNT: usize = 14;

#[derive(Clone, Copy, Debug)]
struct Held {
    /// Bytes from the first slot.
    slot: u32,
    next: Next,
    /// Whether the slot itself has an older value.
    is_newer: bool,
}

/// The values of slots in registers. Where they do not suffice, the value that is needed last gives way (Belady, 1966).
#[derive(Debug, Default)]
pub(super) struct Registers {
    held: [Option<Held>; COUNT],
    /// Registers that the current instruction uses.
    locked: [bool; COUNT],
}

impl Registers {
    /// Begins an instruction.
    pub fn begin(&mut self) {
        self.locked = [false; COUNT];
    }

    /// The register that holds a slot.
    fn find(&self, slot: u32) -> Option<usize> {
        self.held.iter().position(|held| held.is_some_and(|held| held.slot == slot))
    }

    /// Where to read a slot, which is read `next` after this.
    pub fn read(&mut self, slot: u32, next: Next, out: &mut Assembler) -> Place {
        if let Some(found) = self.find(slot) {
            self.locked[found] = true;
            if let Some(held) = &mut self.held[found] {
                held.next = next;
            }
            return Place::Register(Register(found as u8));
        }
        // Worth a register if it is read again before what it displaces.
        let place = if next < AFTERWARDS { self.place_before(next) } else { None };
        let Some(place) = place else { return Place::Memory(slot) };
        self.free(place, out);
        self.held[place] = Some(Held { slot, next, is_newer: false });
        self.locked[place] = true;
        let register = Register(place as u8);
        out.load(register, slot);
        Place::Register(register)
    }

    /// The register of an operand that nothing reads after the current instruction.
    pub fn last(&self, place: Place) -> Option<Register> {
        let Place::Register(register) = place else { return None };
        self.held[usize::from(register.0)].filter(|held| held.next == NEVER).map(|_| register)
    }

    /// A register for a result; instructions have fewer operands than there are registers.
    pub fn take(&mut self, out: &mut Assembler) -> Register {
        let place = self.place_before(0).unwrap_or_default();
        self.free(place, out);
        Register(place as u8)
    }

    /// The result of the current instruction is in this register, for this slot. Ends the instruction.
    pub fn write(&mut self, Register(number): Register, slot: u32, next: Next) {
        for held in &mut self.held {
            if held.is_some_and(|held| held.next == NEVER || held.slot == slot) {
                *held = None;
            }
        }
        self.held[usize::from(number)] = (next != NEVER).then_some(Held { slot, next, is_newer: true });
    }

    /// Stores all values that are read again, and empties the registers.
    pub fn flush(&mut self, out: &mut Assembler) {
        (0..COUNT).for_each(|place| self.free(place, out));
    }

    /// A register that is free, or whose value is read after `next`: the one that is read last.
    fn place_before(&self, next: Next) -> Option<usize> {
        let until = |place: usize| self.held[place].map_or(NEVER, |held| held.next);
        let unlocked = (0..COUNT).filter(|&place| !self.locked[place]);
        unlocked.max_by_key(|&place| until(place)).filter(|&place| until(place) > next)
    }

    fn free(&mut self, place: usize, out: &mut Assembler) {
        if let Some(Held { slot, next, is_newer: true }) = self.held[place].take()
            && next != NEVER
        {
            out.store(slot, Register(place as u8));
        }
    }
}
