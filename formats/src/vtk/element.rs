//! Elements of an XML file.

use std::collections::HashMap;

pub(super) type Attributes = HashMap<String, String>;

/// A `DataArray` element with the section that it stands in.
pub(super) struct Element {
    pub section: String,
    pub attributes: Attributes,
    pub text: String,
}
