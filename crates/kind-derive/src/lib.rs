//! `#[derive(Kind)]`: one declaration gives the reader with line and path, the writer, the checks of ranges and the JSON Schema.
//!
//! On a struct with named fields: a table of keys. On a struct with one unnamed field: that field under a name of its own. On an
//! enum: a table named by its kind (variants with one field) or a word (variants without); with `untagged` the variant follows
//! from the type of the value, with `alternatives` from the keys that are given.
//!
//! Attributes, all inside `#[kind(…)]`:
//!
//! | where | attribute | meaning |
//! |---|---|---|
//! | type | `name = "…"` | name in the schema; that of the type unless given |
//! | type | `noun = "…"` | noun in messages; the first sentence of the doc comment unless given, of an enum its name; of an untagged enum all that is expected |
//! | type | `before = function` | `fn(&NodeCursor) -> Result<(), DesignError>`: refuses a value before it is read, to explain common mistakes |
//! | type | `check = function` | `fn(&Self, &Key) -> Result<(), Fault>`: what fields must keep together, checked after each |
//! | enum | `untagged`, `alternatives` | see above |
//! | enum | `inherit` | limits of the place where it stands hold for its numbers, instead of the variant's |
//! | enum | `keyed` | gives `key(&self) -> &'static str` |
//! | enum | `family = Trait` | gives `family(&self) -> &dyn Trait`, and `key` |
//! | field | `unit = "mm"` | unit |
//! | field | `above`, `below`, `min`, `max` | limits of each number, exclusive and inclusive |
//! | field | `least = n` | least number of items of a list or map |
//! | field | `default = EXPR`, `default` | the value if absent; without it a key is required, unless it is an `Option` |
//! | field | `always` | written even if it has its default |
//! | field | `flatten` | the keys of that type stand in this table |
//! | field | `skip` | not part of the data: `Default::default()` when read |
//! | field | `inherit` | limits of the place where the table stands hold for it, instead of its own |
//! | field | `keyword` | this and later keys are keyword arguments in Python |
//! | field, variant | `rename = "…"` | its key; that of the field, of a variant its name in lower case, unless given |
//! | field, variant | `hints("…", …)` | words that others use for it |

use proc_macro::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Fields, parse_macro_input};

mod attributes;
mod choice;
mod table;

/// Derives `Kind` (and `Table`, where keys are known); see the head of the crate.
#[proc_macro_derive(Kind, attributes(kind))]
pub fn kind(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand(&input).unwrap_or_else(|e| e.to_compile_error()).into()
}

fn expand(input: &DeriveInput) -> syn::Result<proc_macro2::TokenStream> {
    let outer = attributes::TypeAttributes::of(input)?;
    let made = match &input.data {
        Data::Struct(s) => match &s.fields {
            Fields::Named(fields) => table::named(&input.ident, &outer, &fields.named)?,
            Fields::Unnamed(fields) if fields.unnamed.len() == 1 => {
                table::transparent(&input.ident, &outer, &fields.unnamed[0])?
            }
            _ => return Err(Error::new_spanned(&input.ident, "a kind has named fields, or one")),
        },
        Data::Enum(e) if outer.untagged => choice::untagged(&input.ident, &outer, e)?,
        Data::Enum(e) if outer.alternatives => choice::alternatives(&input.ident, &outer, e)?,
        Data::Enum(e) => choice::tagged(&input.ident, &outer, e)?,
        Data::Union(_) => return Err(Error::new_spanned(&input.ident, "a union is no kind")),
    };
    Ok(quote! { const _: () = { use crate::kind::*; #made }; })
}
