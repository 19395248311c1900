//! The container format: nested items, each with named values and arrays.
//!
//! | part       | bytes                                                                                                            |
//! |------------|------------------------------------------------------------------------------------------------------------------|
//! | head       | 60 of text (`#FileJBD ` and what is in it, blanks, a line feed, 0); byte order, 10 more with wide counts; wide or not; 2 of 0 |
//! | item       | u4 size of its definition: `\nITEM\n`, its name, i4 hidden, i4 values hidden, two formats of numbers, u4 arrays, u4 items, u4 size of the values |
//! |            | then these, the arrays, the items                                                                                 |
//! | values     | `\nVALUES`, u4 how many; each a name, i4 kind, and its bytes                                                      |
//! | array      | u4 size of its definition: `\nARRAY`, its name, i4 hidden, i4 kind, count and bytes of the numbers (u4, or u8 where they are wide) |
//! |            | then the numbers                                                                                                  |
//!
//! A text is a u4 length and its bytes. Counts are wide in files of 4 GB and more.

use super::schema::{CONTENT, MAGIC, NAME};
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::Values;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

const HEAD: usize = 64;
const TITLE: usize = 60;
const ITEM: &str = "\nITEM\n";
const VALUES: &str = "\nVALUES";
const ARRAY: &str = "\nARRAY";
/// With which the code's tools print numbers.
const FORMATS: [&str; 2] = ["%.7E", "%.15E"];

/// From so many bytes on counts are wide, as in the code.
const WIDE: u64 = 4_228_102_018;
/// Most items within items, and most items, values and arrays in all: those of the code have tens.
const DEEPEST: usize = 8;
const MOST_PARTS: usize = 100_000;

/// Kind of a value or of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Text,
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Kinds by their number; those of triples are not among them.
const KINDS: [(Kind, i32, usize); 12] = [
    (Kind::Text, 1, 0),
    (Kind::Bool, 2, 4),
    (Kind::I8, 3, 1),
    (Kind::U8, 4, 1),
    (Kind::I16, 5, 2),
    (Kind::U16, 6, 2),
    (Kind::I32, 7, 4),
    (Kind::U32, 8, 4),
    (Kind::I64, 9, 8),
    (Kind::U64, 10, 8),
    (Kind::F32, 11, 4),
    (Kind::F64, 12, 8),
];
const TRIPLES: [(Kind, i32); 4] = [(Kind::I32, 20), (Kind::U32, 21), (Kind::F32, 22), (Kind::F64, 23)];

impl Kind {
    /// The kind and the components of a number.
    fn of(number: i32) -> Option<(Self, usize)> {
        let triple = TRIPLES.iter().find(|t| t.1 == number).map(|t| (t.0, 3));
        triple.or_else(|| KINDS.iter().find(|k| k.1 == number).map(|k| (k.0, 1)))
    }

    fn number(self, components: usize) -> i32 {
        let triple = TRIPLES.iter().find(|t| t.0 == self && components == 3).map(|t| t.1);
        triple.or_else(|| KINDS.iter().find(|k| k.0 == self).map(|k| k.1)).unwrap_or_default()
    }

    pub fn width(self) -> usize {
        KINDS.iter().find(|k| k.0 == self).map_or(0, |k| k.2)
    }

    fn is_real(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    fn real(self, bytes: &[u8]) -> f64 {
        match (self, bytes.first_chunk(), bytes.first_chunk()) {
            (Self::F32, Some(b), _) => f32::from_le_bytes(*b).into(),
            (Self::F64, _, Some(b)) => f64::from_le_bytes(*b),
            _ => self.whole(bytes) as f64,
        }
    }

    fn whole(self, bytes: &[u8]) -> i64 {
        let mut wide = [0; 8];
        wide.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let value = i64::from_le_bytes(wide);
        match self {
            Self::I8 => i64::from(value as i8),
            Self::I16 => i64::from(value as i16),
            Self::I32 | Self::Bool => i64::from(value as i32),
            _ => value,
        }
    }
}

/// A named value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Text(String),
    Bool(bool),
    Whole(Kind, i64),
    Real(f64),
    Triple([f64; 3]),
}

/// An array, and where its numbers are.
#[derive(Debug, Clone)]
pub struct Array {
    pub name: String,
    pub kind: Kind,
    pub components: usize,
    pub count: u64,
    at: u64,
}

#[derive(Debug, Clone, Default)]
pub struct Item {
    pub name: String,
    pub values: Vec<(String, Value)>,
    pub arrays: Vec<Array>,
    pub items: Vec<Item>,
}

impl Item {
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.values.iter().find(|v| v.0 == name).map(|v| &v.1)
    }

    pub fn text(&self, name: &str) -> Option<&str> {
        match self.value(name)? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Value::Real(v) => Some(*v),
            Value::Whole(_, v) => Some(*v as f64),
            Value::Bool(v) => Some(f64::from(u8::from(*v))),
            Value::Text(_) | Value::Triple(_) => None,
        }
    }

    pub fn triple(&self, name: &str) -> Option<[f64; 3]> {
        match self.value(name)? {
            Value::Triple(v) => Some(*v),
            _ => None,
        }
    }

    pub fn array(&self, name: &str) -> Option<&Array> {
        self.arrays.iter().find(|a| a.name == name)
    }
}

/// A file that is read.
pub struct Source<'a> {
    pub path: &'a Path,
    file: BufReader<File>,
    length: u64,
    at: u64,
    wide: bool,
    parts: usize,
    budget: Budget,
}

impl<'a> Source<'a> {
    /// Opens a file and reads all of it but the numbers of arrays.
    ///
    /// # Errors
    /// [`FormatError::Input`] where it is damaged, [`FormatError::Limit`] for sizes beyond it, [`FormatError::Unsupported`], [`FormatError::Io`].
    pub fn open(path: &'a Path) -> Result<(Self, Item)> {
        let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
        let file = BufReader::new(file);
        let mut source = Self { path, file, length, at: 0, wide: false, parts: 0, budget: Budget::new(length) };
        let head = source.bytes(HEAD as u64, "head")?;
        if !head.starts_with(MAGIC) {
            let problem = "does not begin with '#FileJBD JPartDataBi4', as files of particles do";
            return Err(source.error("head", problem));
        }
        source.wide = head[TITLE + 1] != 0;
        if head[TITLE] != if source.wide { 10 } else { 0 } {
            let what = "numbers in another byte order than little-endian, which the code does not read either";
            return Err(FormatError::Unsupported { path: path.into(), format: NAME, what: what.into() });
        }
        let root = source.item(0)?;
        Ok((source, root))
    }

    pub fn error(&self, location: &str, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, NAME, location, problem)
    }

    fn left(&self) -> u64 {
        self.length.saturating_sub(self.at)
    }

    /// The next bytes, which are there before room is made for them.
    fn bytes(&mut self, count: u64, what: &str) -> Result<Vec<u8>> {
        if count > self.left() {
            return Err(FormatError::Limit {
                path: self.path.into(),
                format: NAME,
                location: format!("{what} at byte {}", self.at),
                declared: format!("{count} bytes"),
                allowed: format!("the {} that are left of the file", self.left()),
            });
        }
        let mut bytes = vec![0; count as usize];
        self.file.read_exact(&mut bytes).map_err(|e| FormatError::io(self.path, "read", e))?;
        self.at += count;
        Ok(bytes)
    }

    fn word(&mut self, what: &str) -> Result<u32> {
        Ok(Kind::U32.whole(&self.bytes(4, what)?) as u32)
    }

    fn text(&mut self, what: &str) -> Result<String> {
        let length = self.word(what)?;
        let bytes = self.bytes(length.into(), what)?;
        Ok(String::from_utf8(bytes).unwrap_or_else(|e| e.into_bytes().iter().map(|b| char::from(*b)).collect()))
    }

    fn code(&mut self, code: &str, what: &str) -> Result<()> {
        let at = self.at;
        let found = self.text(what)?;
        if found == code {
            return Ok(());
        }
        Err(self.error(&format!("byte {at}"), format!("'{}' is expected, where {what} begins", code.trim())))
    }

    /// Counts one more item, value or array.
    fn count(&mut self) -> Result<()> {
        self.parts += 1;
        if self.parts > MOST_PARTS {
            let problem = format!("more than {MOST_PARTS} items, values and arrays are in it");
            return Err(self.error(&format!("byte {}", self.at), problem));
        }
        Ok(())
    }

    fn item(&mut self, depth: usize) -> Result<Item> {
        self.count()?;
        if depth > DEEPEST {
            return Err(
                self.error(&format!("byte {}", self.at), format!("more than {DEEPEST} items are within another"))
            );
        }
        self.word("an item")?;
        self.code(ITEM, "an item")?;
        let name = self.text("an item's name")?;
        self.bytes(8, "an item")?;
        for _ in FORMATS {
            self.text("a format of numbers")?;
        }
        let (arrays, items) = (self.word("an item")?, self.word("an item")?);
        let size = u64::from(self.word("an item")?);
        let mut item = Item { name, ..Item::default() };
        if size > 0 {
            let end = self.at + size;
            self.code(VALUES, "the values")?;
            for _ in 0..self.word("the values")? {
                item.values.push(self.value()?);
            }
            if self.at != end {
                let problem = format!("the values of item '{}' end here, expected at byte {end}", item.name);
                return Err(self.error(&format!("byte {}", self.at), problem));
            }
        }
        for _ in 0..arrays {
            item.arrays.push(self.array()?);
        }
        for _ in 0..items {
            item.items.push(self.item(depth + 1)?);
        }
        Ok(item)
    }

    fn value(&mut self) -> Result<(String, Value)> {
        self.count()?;
        let name = self.text("a value's name")?;
        let (kind, components) = self.kind(&name)?;
        if kind == Kind::Text {
            return Ok((name, Value::Text(self.text("a text")?)));
        }
        let width = kind.width();
        let bytes = self.bytes((width * components) as u64, "a value")?;
        let value = match components {
            3 => Value::Triple(std::array::from_fn(|k| kind.real(&bytes[k * width..(k + 1) * width]))),
            _ if kind == Kind::Bool => Value::Bool(kind.whole(&bytes) != 0),
            _ if kind.is_real() => Value::Real(kind.real(&bytes)),
            _ => Value::Whole(kind, kind.whole(&bytes)),
        };
        Ok((name, value))
    }

    fn kind(&mut self, name: &str) -> Result<(Kind, usize)> {
        let number = self.word("a kind")? as i32;
        Kind::of(number).ok_or_else(|| self.error(&format!("'{name}'"), format!("is of kind {number}, which is none")))
    }

    fn array(&mut self) -> Result<Array> {
        self.count()?;
        self.word("an array")?;
        self.code(ARRAY, "an array")?;
        let name = self.text("an array's name")?;
        self.bytes(4, "an array")?;
        let (kind, components) = self.kind(&name)?;
        let width = if self.wide { 8 } else { 4 };
        let mut size = || self.bytes(width, "an array").map(|b| Kind::U64.whole(&b) as u64);
        let (count, bytes) = (size()?, size()?);
        let expected = count.checked_mul((kind.width() * components) as u64);
        if kind != Kind::Text && expected != Some(bytes) {
            let problem = format!("{count} numbers are said to take {bytes} bytes");
            return Err(self.error(&format!("array '{name}'"), problem));
        }
        if bytes > self.left() {
            return Err(FormatError::Limit {
                path: self.path.into(),
                format: NAME,
                location: format!("array '{name}'"),
                declared: format!("{bytes} bytes"),
                allowed: format!("the {} that are left of the file", self.left()),
            });
        }
        let at = self.at;
        self.at += bytes;
        self.file.seek(SeekFrom::Start(self.at)).map_err(|e| FormatError::io(self.path, "read", e))?;
        Ok(Array { name, kind, components, count, at })
    }

    /// The numbers of an array, at its places from `slots` of each row.
    ///
    /// # Errors
    /// [`FormatError::Limit`], [`FormatError::Io`].
    pub fn numbers(&mut self, array: &Array, slots: &[usize]) -> Result<Values> {
        let (kind, width) = (array.kind, array.kind.width());
        let count = array.count as usize * slots.len();
        let in_memory = if kind == Kind::F32 { 4 } else { 8 };
        let location = format!("array '{}'", array.name);
        self.budget.take(self.path, NAME, &location, (count * in_memory) as u64)?;
        let io = |e| FormatError::io(self.path, "read", e);
        self.file.seek(SeekFrom::Start(array.at)).map_err(io)?;
        let mut row = vec![0; width * array.components];
        let mut values = match kind {
            Kind::F32 => Values::F32(Vec::with_capacity(count)),
            Kind::F64 => Values::F64(Vec::with_capacity(count)),
            _ => Values::I64(Vec::with_capacity(count)),
        };
        for _ in 0..array.count {
            self.file.read_exact(&mut row).map_err(io)?;
            for slot in slots {
                let bytes = &row[slot * width..(slot + 1) * width];
                match &mut values {
                    Values::F32(v) => v.push(kind.real(bytes) as f32),
                    Values::F64(v) => v.push(kind.real(bytes)),
                    Values::I64(v) => v.push(kind.whole(bytes)),
                }
            }
        }
        Ok(values)
    }
}

/// The head of a file of so many bytes, and whether its counts are wide.
pub fn head(bytes: u64) -> (Vec<u8>, bool) {
    let wide = bytes >= WIDE;
    let mut head = format!("#FileJBD {CONTENT}").into_bytes();
    head.resize(TITLE - 2, b' ');
    head.extend([b'\n', 0, if wide { 10 } else { 0 }, u8::from(wide), 0, 0]);
    (head, wide)
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// A definition behind its size.
fn sized(definition: Vec<u8>) -> Vec<u8> {
    [&(definition.len() as u32).to_le_bytes()[..], &definition].concat()
}

/// An item up to its arrays.
pub fn item(name: &str, values: &[(&str, Value)], arrays: usize, items: usize) -> Vec<u8> {
    let mut of_values = Vec::new();
    put_text(&mut of_values, VALUES);
    of_values.extend((values.len() as u32).to_le_bytes());
    values.iter().for_each(|(name, value)| put_value(&mut of_values, name, value));
    let mut definition = Vec::new();
    put_text(&mut definition, ITEM);
    put_text(&mut definition, name);
    definition.extend([0; 8]);
    FORMATS.iter().for_each(|format| put_text(&mut definition, format));
    for number in [arrays, items, of_values.len()] {
        definition.extend((number as u32).to_le_bytes());
    }
    [sized(definition), of_values].concat()
}

fn put_value(out: &mut Vec<u8>, name: &str, value: &Value) {
    put_text(out, name);
    let mut put = |kind: Kind, components: usize, bytes: &[u8]| {
        out.extend(kind.number(components).to_le_bytes());
        out.extend(bytes);
    };
    match value {
        Value::Text(text) => {
            put(Kind::Text, 1, &[]);
            put_text(out, text);
        }
        Value::Bool(v) => put(Kind::Bool, 1, &i32::from(*v).to_le_bytes()),
        Value::Whole(kind, v) => put(*kind, 1, &v.to_le_bytes()[..kind.width()]),
        Value::Real(v) => put(Kind::F64, 1, &v.to_le_bytes()),
        Value::Triple(v) => put(Kind::F64, 3, &v.map(f64::to_le_bytes).concat()),
    }
}

/// An array up to its numbers.
pub fn array(name: &str, (kind, components): (Kind, usize), count: usize, wide: bool) -> Vec<u8> {
    let mut definition = Vec::new();
    put_text(&mut definition, ARRAY);
    put_text(&mut definition, name);
    definition.extend([0; 4]);
    definition.extend(kind.number(components).to_le_bytes());
    for size in [count, count * components * kind.width()] {
        definition.extend(&(size as u64).to_le_bytes()[..if wide { 8 } else { 4 }]);
    }
    sized(definition)
}
