//! The header: encoding, elements and their properties.

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Text,
    Little,
    Big,
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    pub fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value of as many bytes, little-endian.
    pub fn value(self, b: [u8; 8]) -> f64 {
        let [b0, b1, b2, b3, ..] = b;
        match self {
            Self::I8 => f64::from(i8::from_le_bytes([b0])),
            Self::U8 => f64::from(b0),
            Self::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Self::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Self::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            Self::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            Self::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Self::F64 => f64::from_le_bytes(b),
        }
    }
}

/// What one entry of a property means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Coordinate(usize),
    Polygon,
    Strips,
    None,
}

#[derive(Debug, Clone, Copy)]
pub struct Property {
    /// Type of a list's length; none for a single number.
    pub length: Option<Number>,
    pub number: Number,
    pub role: Role,
}

#[derive(Debug, Clone)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes that a row takes at least.
    pub fn least_bytes(&self, encoding: Encoding) -> u64 {
        let of = |p: &Property| match encoding {
            // A digit and what divides it from the next.
            Encoding::Text => 2,
            _ => p.length.unwrap_or(p.number).bytes() as u64,
        };
        self.properties.iter().map(of).sum()
    }
}

#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    pub comments: Vec<String>,
}

/// Parses the lines between `ply` and `end_header`; an error has the line's number.
pub fn parse(lines: &[String]) -> Result<Header, (usize, String)> {
    let (mut encoding, mut elements, mut comments) = (None, Vec::<Element>::new(), Vec::new());
    for (i, line) in lines.iter().enumerate() {
        let number = i + 1;
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [] | ["ply" | "obj_info", ..] => {}
            ["comment", ..] => comments.push(line.trim_start().chars().skip(8).take(200).collect()),
            ["format", name, _] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => {
                        let shown: String = other.chars().take(30).collect();
                        let expected = "expected ascii, binary_little_endian or binary_big_endian";
                        return Err((number, format!("has the format '{shown}', {expected}")));
                    }
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| (number, "has no number of rows".to_owned()))?;
                let name = name.chars().take(40).collect();
                elements.push(Element { name, count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err((number, "has a property before any element".into()));
                };
                let property = property(&element.name, rest).ok_or_else(|| {
                    let problem = "has a property that is not understood, expected `property TYPE NAME` or `property list TYPE TYPE NAME`";
                    (number, problem.to_owned())
                })?;
                element.properties.push(property);
            }
            [word, ..] => {
                let shown: String = word.chars().take(30).collect();
                return Err((number, format!("begins with '{shown}', expected element, property or comment")));
            }
        }
    }
    let encoding = encoding.ok_or((2, "there is no line `format` in the header".to_owned()))?;
    Ok(Header { encoding, elements, comments })
}

fn property(element: &str, words: &[&str]) -> Option<Property> {
    match words {
        ["list", length, number, name] => {
            let role = match (element, *name) {
                ("face", "vertex_indices" | "vertex_index") => Role::Polygon,
                ("tristrips", "vertex_indices" | "vertex_index") => Role::Strips,
                _ => Role::None,
            };
            let length = Number::parse(length).filter(|n| !matches!(n, Number::F32 | Number::F64))?;
            Some(Property { length: Some(length), number: Number::parse(number)?, role })
        }
        [number, name] => {
            let axis = ["x", "y", "z"].iter().position(|axis| element == "vertex" && axis == name);
            let role = axis.map_or(Role::None, Role::Coordinate);
            Some(Property { length: None, number: Number::parse(number)?, role })
        }
        _ => None,
    }
}
