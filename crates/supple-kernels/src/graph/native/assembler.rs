//! Machine code of x86-64 with AVX and fused multiply-add, on single numbers.

/// A vector register, of which there are 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Register(pub u8);

/// Where an operand is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Register(Register),
    /// In the slots, so many bytes from the first.
    Memory(u32),
}

/// Operations of three registers, the last of which may be in memory: `to = first op second`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Mul,
    Sub,
    Div,
}

/// Holds the address of the slots while the code runs.
const BASE: u8 = 3;

/// How an instruction is encoded: Intel's manual, volume 2, chapter 2.3 (VEX prefix).
#[derive(Clone, Copy)]
struct Form {
    /// 1: `0F`, 2: `0F 38`, 3: `0F 3A`.
    map: u8,
    /// 1: `66`, 3: `F2`.
    prefix: u8,
    wide: bool,
    opcode: u8,
}

const fn scalar(opcode: u8) -> Form {
    Form { map: 1, prefix: 3, wide: false, opcode }
}

const LOAD: Form = scalar(0x10);
const STORE: Form = scalar(0x11);
const SQRT: Form = scalar(0x51);
const COMPARE: Form = scalar(0xC2);
const MOVE: Form = Form { map: 1, prefix: 1, wide: false, opcode: 0x28 };
const XOR: Form = Form { map: 1, prefix: 1, wide: false, opcode: 0x57 };
const FROM_GENERAL: Form = Form { map: 1, prefix: 1, wide: true, opcode: 0x6E };
const MULTIPLY_ADD: Form = Form { map: 2, prefix: 1, wide: true, opcode: 0xB9 };
const BLEND: Form = Form { map: 3, prefix: 1, wide: false, opcode: 0x4B };

/// No second register.
const NONE: Register = Register(0);

/// Writes machine code.
#[derive(Debug, Default)]
pub(super) struct Assembler {
    pub code: Vec<u8>,
}

impl Assembler {
    /// The beginning of a function whose argument is the address of the slots.
    pub fn begin(&mut self) {
        // push rbx; mov rbx, rdi
        self.code.extend([0x53, 0x48, 0x89, 0xFB]);
    }

    /// Its end.
    pub fn end(&mut self) {
        // pop rbx; ret
        self.code.extend([0x5B, 0xC3]);
    }

    pub fn load(&mut self, to: Register, offset: u32) {
        self.encode(LOAD, to, NONE, Place::Memory(offset));
    }

    pub fn store(&mut self, offset: u32, from: Register) {
        self.encode(STORE, from, NONE, Place::Memory(offset));
    }

    /// `to = from`
    pub fn copy(&mut self, to: Register, from: Place) {
        match from {
            Place::Register(from) if from == to => {}
            Place::Register(_) => self.encode(MOVE, to, NONE, from),
            Place::Memory(offset) => self.load(to, offset),
        }
    }

    pub fn binary(&mut self, operation: Binary, to: Register, first: Register, second: Place) {
        let opcode = match operation {
            Binary::Add => 0x58,
            Binary::Mul => 0x59,
            Binary::Sub => 0x5C,
            Binary::Div => 0x5E,
        };
        self.encode(scalar(opcode), to, first, second);
    }

    /// `to = first second + to`, rounded once.
    pub fn multiply_add(&mut self, to: Register, first: Register, second: Place) {
        self.encode(MULTIPLY_ADD, to, first, second);
    }

    pub fn sqrt(&mut self, to: Register, from: Register) {
        self.encode(SQRT, to, from, Place::Register(from));
    }

    /// All bits of `to` become 1 if `value` is above 0, and 0 if not.
    pub fn is_positive(&mut self, to: Register, value: Place) {
        self.encode(XOR, to, to, Place::Register(to));
        self.encode(COMPARE, to, to, value);
        // 0 < value
        self.code.push(1);
    }

    /// `to = if mask { yes } else { no }`
    pub fn blend(&mut self, to: Register, mask: Register, yes: Register, no: Register) {
        self.encode(BLEND, to, no, Place::Register(yes));
        self.code.push(mask.0 << 4);
    }

    /// `to = value`
    pub fn constant(&mut self, to: Register, value: f64) {
        // mov rax, value
        self.code.extend([0x48, 0xB8]);
        self.code.extend(value.to_bits().to_le_bytes());
        self.encode(FROM_GENERAL, to, NONE, Place::Register(Register(0)));
    }

    /// Calls a function with the address of the slots and two numbers. All vector registers are lost.
    pub fn call(&mut self, function: usize, second: usize, third: usize) {
        // mov rdi, rbx; mov rsi, second; mov rdx, third; mov rax, function; call rax
        self.code.extend([0x48, 0x89, 0xDF]);
        for (opcode, value) in [([0x48, 0xBE], second), ([0x48, 0xBA], third), ([0x48, 0xB8], function)] {
            self.code.extend(opcode);
            self.code.extend((value as u64).to_le_bytes());
        }
        self.code.extend([0xFF, 0xD0]);
    }

    fn encode(&mut self, form: Form, to: Register, first: Register, second: Place) {
        let Form { map, prefix, wide, opcode } = form;
        let base = match second {
            Place::Register(Register(number)) => number,
            Place::Memory(_) => BASE,
        };
        let high = |number: u8, bit: u8| u8::from(number < 8) << bit;
        self.code.extend([
            0xC4,
            high(to.0, 7) | 1 << 6 | high(base, 5) | map,
            u8::from(wide) << 7 | (!first.0 & 15) << 3 | prefix,
            opcode,
        ]);
        let (to, base) = ((to.0 & 7) << 3, base & 7);
        match second {
            Place::Register(_) => self.code.push(3 << 6 | to | base),
            Place::Memory(offset) if offset < 128 => self.code.extend([1 << 6 | to | base, offset as u8]),
            Place::Memory(offset) => {
                self.code.push(2 << 6 | to | base);
                self.code.extend(offset.to_le_bytes());
            }
        }
    }
}
