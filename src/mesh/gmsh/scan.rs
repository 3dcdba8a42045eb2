//! The sections of a file and the numbers in them, the same way for ASCII and binary.

use super::Fault;

/// A place in the file.
pub struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    section: String,
    /// Set once the format section has been read.
    pub binary: bool,
    /// Whether the bytes of a number are in the order of other machines.
    big_endian: bool,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, section: String::new(), binary: false, big_endian: false }
    }

    /// An error about the current section.
    pub fn fault(&self, what: &str) -> Fault {
        Fault::new(format!("section ${}: {what}", self.section), "export the mesh from Gmsh again")
    }

    fn cut_off(&self) -> Fault {
        let hint = "the file is incomplete: copy it or export it from Gmsh again";
        Fault::new(format!("section ${} is cut off: the file ends inside it", self.section), hint)
    }

    /// Enters the next section and returns its name; `None` at the end of the file.
    pub fn enter(&mut self) -> Result<Option<String>, Fault> {
        self.skip_space();
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let line = self.rest_of_line();
        let text = String::from_utf8_lossy(line).trim_end().to_owned();
        match text.strip_prefix('$') {
            Some(name) => {
                self.at += (line.len() + 1).min(self.bytes.len() - self.at);
                name.clone_into(&mut self.section);
                Ok(Some(self.section.clone()))
            }
            None => {
                let shown: String = text.chars().take(40).collect();
                let hint = "give a mesh file of Gmsh (.msh); geometry files (.geo) are meshed with `gmsh file.geo -2 \
                 -o file.msh`";
                Err(Fault::new(format!("expected a section such as $MeshFormat or $Nodes, found `{shown}`"), hint))
            }
        }
    }

    /// Leaves a section that has been read to its end.
    pub fn leave(&mut self) -> Result<(), Fault> {
        self.skip_space();
        let marker = format!("$End{}", self.section);
        let rest = &self.bytes[self.at..];
        if rest.starts_with(marker.as_bytes()) {
            self.at += marker.len();
            Ok(())
        } else if marker.as_bytes().starts_with(rest) {
            Err(self.cut_off())
        } else {
            Err(self.fault(&format!("{marker} is not where the counts in the section put it")))
        }
    }

    /// Leaves a section unread.
    pub fn skip(&mut self) -> Result<(), Fault> {
        let marker = format!("$End{}", self.section);
        let rest = &self.bytes[self.at..];
        let found = rest.windows(marker.len()).position(|window| window == marker.as_bytes());
        self.at += found.ok_or_else(|| self.cut_off())? + marker.len();
        Ok(())
    }

    /// The next line that is not empty.
    pub fn whole_line(&mut self) -> Result<&'a str, Fault> {
        self.skip_space();
        self.line()
    }

    /// The rest of the current line, without its end.
    pub fn line(&mut self) -> Result<&'a str, Fault> {
        let line = self.rest_of_line();
        if self.at + line.len() == self.bytes.len() {
            return Err(self.cut_off());
        }
        self.at += line.len() + 1;
        std::str::from_utf8(line).map_err(|_| self.fault("a line of text is not UTF-8"))
    }

    fn rest_of_line(&self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        &rest[..rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len())]
    }

    /// A number in ASCII even in a binary file, as in the section of physical names.
    pub fn text<T: std::str::FromStr>(&mut self) -> Result<T, Fault> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        // The end marker of the section must follow, so a number at the end of the file is cut off too.
        if length == rest.len() {
            return Err(self.cut_off());
        }
        self.at += length;
        let token = String::from_utf8_lossy(&rest[..length]);
        token.parse().map_err(|_| self.fault(&format!("expected a number, found `{token}`")))
    }

    /// The count at the head of a section of format 2, which is text in binary files too.
    pub fn header(&mut self) -> Result<usize, Fault> {
        let count = self.text()?;
        self.line()?;
        Ok(count)
    }

    /// Reads the number 1 that tells the order of bytes.
    pub fn begin_binary(&mut self) -> Result<(), Fault> {
        self.binary = true;
        match self.raw::<4>()? {
            [1, 0, 0, 0] => Ok(()),
            [0, 0, 0, 1] => {
                self.big_endian = true;
                Ok(())
            }
            other => {
                Err(self.fault(&format!("the number that tells the order of bytes is {other:?}, and should be 1")))
            }
        }
    }

    /// An integer (4 bytes in a binary file).
    pub fn int(&mut self) -> Result<i32, Fault> {
        if self.binary { self.raw().map(i32::from_le_bytes) } else { self.text() }
    }

    /// A count, or a number of a node or element, of 4 bytes in a binary file.
    pub fn number(&mut self) -> Result<usize, Fault> {
        if !self.binary {
            return self.text();
        }
        let value = self.int()?;
        usize::try_from(value).map_err(|_| self.fault(&format!("{value} is no number of a node or an element")))
    }

    /// A count or a node or element number (8 bytes).
    pub fn size(&mut self) -> Result<usize, Fault> {
        if !self.binary {
            return self.text();
        }
        let value = self.raw().map(u64::from_le_bytes)?;
        usize::try_from(value).map_err(|_| self.fault("a count does not fit into memory"))
    }

    /// A coordinate (8 bytes).
    pub fn real(&mut self) -> Result<f64, Fault> {
        let value = self.skip_real()?;
        if value.is_finite() { Ok(value) } else { Err(self.fault("a coordinate is not finite")) }
    }

    /// A number of 8 bytes that need not be finite.
    pub fn skip_real(&mut self) -> Result<f64, Fault> {
        if self.binary { self.raw().map(f64::from_le_bytes) } else { self.text() }
    }

    /// The next bytes, the lowest first.
    fn raw<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut bytes = *self.bytes[self.at..].first_chunk::<N>().ok_or_else(|| self.cut_off())?;
        self.at += N;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn skip_space(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
    }
}
