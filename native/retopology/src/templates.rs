//! Templates.
#[derive(Debug, thiserror::Error)]
pub enum TemplateError {}
