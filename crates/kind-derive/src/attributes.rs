//! The attributes of a kind, its fields and variants.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Attribute, DeriveInput, Expr, ExprLit, Lit, LitInt, LitStr, Meta, Path};

/// Attributes of the type.
#[derive(Default)]
pub struct TypeAttributes {
    pub name: String,
    pub noun: Option<String>,
    pub doc: String,
    pub check: Option<Path>,
    pub before: Option<Path>,
    pub family: Option<Path>,
    pub untagged: bool,
    pub alternatives: bool,
    pub inherit: bool,
    pub keyed: bool,
}

impl TypeAttributes {
    pub fn of(input: &DeriveInput) -> syn::Result<TypeAttributes> {
        let mut out =
            TypeAttributes { name: input.ident.to_string(), doc: doc(&input.attrs), ..TypeAttributes::default() };
        each(&input.attrs, |meta| {
            if meta.path.is_ident("name") {
                out.name = meta.value()?.parse::<LitStr>()?.value();
            } else if meta.path.is_ident("noun") {
                out.noun = Some(meta.value()?.parse::<LitStr>()?.value());
            } else if meta.path.is_ident("check") {
                out.check = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("before") {
                out.before = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("family") {
                out.family = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("keyed") {
                out.keyed = true;
            } else if meta.path.is_ident("untagged") {
                out.untagged = true;
            } else if meta.path.is_ident("alternatives") {
                out.alternatives = true;
            } else if meta.path.is_ident("inherit") {
                out.inherit = true;
            } else {
                return Err(meta.error("unknown attribute of a kind"));
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// The noun of a table in messages: as given, else the first sentence of the doc comment.
    pub fn phrase(&self) -> String {
        self.noun.clone().unwrap_or_else(|| lowered(first_sentence(&self.doc)))
    }
}

/// How a field is filled if its key is absent.
pub enum Absent {
    Required,
    Default(TokenStream),
}

/// Attributes of a field or a variant.
pub struct FieldAttributes {
    pub key: Option<String>,
    pub doc: String,
    pub unit: String,
    pub limits: Vec<(&'static str, Expr)>,
    pub least: Option<LitInt>,
    pub absent: Absent,
    pub flatten: bool,
    pub skip: bool,
    pub inherit: bool,
    pub always: bool,
    pub keyword: bool,
    pub hints: Vec<String>,
}

impl FieldAttributes {
    pub fn of(attrs: &[Attribute]) -> syn::Result<FieldAttributes> {
        let mut out = FieldAttributes {
            key: None,
            doc: doc(attrs),
            unit: String::new(),
            limits: Vec::new(),
            least: None,
            absent: Absent::Required,
            flatten: false,
            skip: false,
            inherit: false,
            always: false,
            keyword: false,
            hints: Vec::new(),
        };
        each(attrs, |meta| {
            let limit = ["above", "below", "min", "max"].into_iter().find(|l| meta.path.is_ident(l));
            if let Some(limit) = limit {
                out.limits.push((limit, meta.value()?.parse()?));
            } else if meta.path.is_ident("unit") {
                out.unit = meta.value()?.parse::<LitStr>()?.value();
            } else if meta.path.is_ident("rename") {
                out.key = Some(meta.value()?.parse::<LitStr>()?.value());
            } else if meta.path.is_ident("least") {
                out.least = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("default") {
                out.absent = Absent::Default(match meta.value() {
                    Ok(value) => {
                        let value: Expr = value.parse()?;
                        quote! { #value }
                    }
                    Err(_) => quote! { Default::default() },
                });
            } else if meta.path.is_ident("flatten") {
                out.flatten = true;
            } else if meta.path.is_ident("skip") {
                out.skip = true;
            } else if meta.path.is_ident("inherit") {
                out.inherit = true;
            } else if meta.path.is_ident("always") {
                out.always = true;
            } else if meta.path.is_ident("keyword") {
                out.keyword = true;
            } else if meta.path.is_ident("hints") {
                meta.parse_nested_words(&mut out.hints)?;
            } else {
                return Err(meta.error("unknown attribute of a key"));
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// The `Key` of this field or variant.
    pub fn describe(&self, name: &str, required: bool) -> TokenStream {
        let FieldAttributes { doc, unit, hints, keyword, .. } = self;
        let limits = self.limits.iter().map(|(limit, v)| {
            let limit = quote::format_ident!("{limit}");
            quote! { #limit: #v, }
        });
        let least = self.least.iter();
        quote! {
            Key {
                name: #name, doc: #doc, unit: #unit, required: #required, keyword: #keyword, hints: &[#(#hints),*],
                #(#limits)* #(least: #least,)* ..Key::NONE
            }
        }
    }
}

trait NestedWords {
    fn parse_nested_words(&self, out: &mut Vec<String>) -> syn::Result<()>;
}

impl NestedWords for syn::meta::ParseNestedMeta<'_> {
    fn parse_nested_words(&self, out: &mut Vec<String>) -> syn::Result<()> {
        let words;
        syn::parenthesized!(words in self.input);
        let words = words.parse_terminated(|w| w.parse::<LitStr>(), syn::Token![,])?;
        out.extend(words.iter().map(LitStr::value));
        Ok(())
    }
}

fn each(attrs: &[Attribute], mut take: impl FnMut(syn::meta::ParseNestedMeta) -> syn::Result<()>) -> syn::Result<()> {
    for attr in attrs.iter().filter(|a| a.path().is_ident("kind")) {
        attr.parse_nested_meta(&mut take)?;
    }
    Ok(())
}

/// The doc comment: lines joined, paragraphs kept apart.
fn doc(attrs: &[Attribute]) -> String {
    let mut out = String::new();
    for attr in attrs.iter().filter(|a| a.path().is_ident("doc")) {
        if let Meta::NameValue(m) = &attr.meta
            && let Expr::Lit(ExprLit { lit: Lit::Str(s), .. }) = &m.value
        {
            let (line, s) = (s.value(), out.ends_with('\n') || out.is_empty());
            match line.trim() {
                "" => out.push_str("\n\n"),
                line => {
                    out.push_str(if s { "" } else { " " });
                    out.push_str(line);
                }
            }
        }
    }
    out.trim().to_string()
}

/// The first sentence, without its full stop.
fn first_sentence(doc: &str) -> &str {
    let end = [". ", "\n", ": ", "; "].iter().filter_map(|e| doc.find(e)).min().unwrap_or(doc.len());
    doc[..end].trim_end_matches('.')
}

fn lowered(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}
