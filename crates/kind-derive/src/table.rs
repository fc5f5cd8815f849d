//! Structs: a table of keys, or one value under a name of its own.

use proc_macro2::TokenStream;
use quote::quote;
use syn::punctuated::Punctuated;
use syn::{Error, Field, Ident, PathArguments, Token, Type};

use crate::attributes::{Absent, FieldAttributes, TypeAttributes};

/// The `T` of an `Option<T>`.
fn optional(ty: &Type) -> Option<&Type> {
    let Type::Path(path) = ty else { return None };
    let last = path.path.segments.last()?;
    let PathArguments::AngleBracketed(of) = &last.arguments else { return None };
    match (last.ident == "Option", of.args.first()) {
        (true, Some(syn::GenericArgument::Type(t))) => Some(t),
        _ => None,
    }
}

/// What each field gives to the parts of the implementations.
#[derive(Default)]
struct Parts {
    keys: Vec<TokenStream>,
    reads: Vec<TokenStream>,
    puts: Vec<TokenStream>,
    checks: Vec<TokenStream>,
    schemas: Vec<TokenStream>,
}

impl Parts {
    fn field(&mut self, field: &Field) -> syn::Result<()> {
        let Some(ident) = &field.ident else { return Err(Error::new_spanned(field, "a field without a name")) };
        let (ty, inner) = (&field.ty, FieldAttributes::of(&field.attrs)?);
        if inner.skip {
            self.reads.push(quote! { #ident: Default::default() });
            return Ok(());
        }
        if inner.flatten {
            self.keys.push(quote! { keys.extend(<#ty as Table>::keys()); });
            self.reads.push(quote! { #ident: <#ty as Table>::from_fields(fields)? });
            self.puts.push(quote! { Table::put(&self.#ident, out); });
            self.checks.push(quote! { Kind::check(&self.#ident, key)?; });
            self.schemas.push(quote! { <#ty as Table>::open(defs, out); });
            return Ok(());
        }
        let name = inner.key.clone().unwrap_or_else(|| ident.to_string());
        let of = optional(ty);
        let required = of.is_none() && matches!(inner.absent, Absent::Required);
        let key = inner.describe(&name, required);
        self.keys.push(quote! { keys.push(#key); });
        let value = of.unwrap_or(ty);
        match (&inner.absent, of) {
            (_, Some(of)) => {
                self.reads.push(quote! { #ident: fields.maybe::<#of>(#name)? });
                self.puts
                    .push(quote! { if let Some(v) = &self.#ident { out.push((#name.into(), None, Kind::write(v))); } });
                self.checks.push(quote! {
                    if let Some(v) = &self.#ident { Kind::check(v, &#key).map_err(|f| f.under(#name))?; }
                });
                self.schemas.push(quote! { out.property::<#value>(#key, None, defs); });
            }
            (Absent::Required, None) => {
                self.reads.push(quote! { #ident: fields.required::<#ty>(&#key)? });
                self.puts.push(quote! { out.push((#name.into(), None, Kind::write(&self.#ident))); });
                self.schemas.push(quote! { out.property::<#value>(#key, None, defs); });
            }
            (Absent::Default(default), None) => {
                self.reads
                    .push(quote! { #ident: match fields.maybe::<#ty>(#name)? { Some(v) => v, None => #default } });
                let always = inner.always;
                self.puts.push(quote! {
                    let default: #ty = #default;
                    if #always || self.#ident != default { out.push((#name.into(), None, Kind::write(&self.#ident))); }
                });
                self.schemas.push(quote! {
                    let default: #ty = #default;
                    out.property::<#value>(#key, Some(Kind::write(&default)), defs);
                });
            }
        }
        if inner.inherit {
            self.checks.push(quote! { Kind::check(&self.#ident, key).map_err(|f| f.under(#name))?; });
        } else if of.is_none() {
            self.checks.push(quote! { Kind::check(&self.#ident, &#key).map_err(|f| f.under(#name))?; });
        }
        Ok(())
    }
}

/// `Kind` for a table: all but its keys and `checks`, which check the ranges of its values.
pub fn kind_of_table(ident: &Ident, outer: &TypeAttributes, checks: &TokenStream) -> TokenStream {
    let (name, doc, noun) = (&outer.name, &outer.doc, outer.phrase());
    let (check, before) = (outer.check.iter(), outer.before.iter());
    quote! {
        impl Kind for #ident {
            const DOC: &'static str = #doc;
            fn expected() -> String {
                expected_table(#noun, &Self::keys())
            }
            fn fits(node: &Node) -> u8 {
                fits_table(node, Self::keys().iter().map(|k| k.name))
            }
            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                #(#before(at)?;)*
                Self::from_fields(&at.table(&Self::expected(), Self::keys())?)
            }
            fn write(&self) -> Node {
                let mut out = Vec::new();
                self.put(&mut out);
                Value::Table(out).into()
            }
            fn check(&self, key: &Key) -> Result<(), Fault> {
                #checks
                #(#check(self, key)?;)*
                Ok(())
            }
            fn schema(_: &Key, defs: &mut Defs) -> Node {
                defs.named(#name, |defs| OpenTable::of::<Self>(defs).closed())
            }
        }
    }
}

/// A struct with named fields.
pub fn named(ident: &Ident, outer: &TypeAttributes, fields: &Punctuated<Field, Token![,]>) -> syn::Result<TokenStream> {
    let mut parts = Parts::default();
    for field in fields {
        parts.field(field)?;
    }
    let Parts { keys, reads, puts, checks, schemas } = parts;
    let kind = kind_of_table(ident, outer, &quote! { #(#checks)* });
    Ok(quote! {
        impl Table for #ident {
            fn keys() -> Vec<Key> {
                let mut keys = Vec::new();
                #(#keys)*
                keys
            }
            fn from_fields(fields: &Fields) -> Result<Self, DesignError> {
                Ok(#ident { #(#reads),* })
            }
            fn put(&self, out: &mut Vec<(String, Option<usize>, Node)>) {
                #(#puts)*
            }
            fn open(defs: &mut Defs, out: &mut OpenTable) {
                #(#schemas)*
            }
        }
        #kind
    })
}

/// A struct with one unnamed field.
pub fn transparent(ident: &Ident, outer: &TypeAttributes, field: &Field) -> syn::Result<TokenStream> {
    let (ty, inner) = (&field.ty, FieldAttributes::of(&field.attrs)?);
    let least = inner.least.iter().collect::<Vec<_>>();
    let (name, doc) = (&outer.name, &outer.doc);
    let (check, before) = (outer.check.iter(), outer.before.iter());
    Ok(quote! {
        impl Kind for #ident {
            const DOC: &'static str = #doc;
            fn expected() -> String {
                <#ty as Kind>::expected()
            }
            fn fits(node: &Node) -> u8 {
                <#ty as Kind>::fits(node)
            }
            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                #(#before(at)?;)*
                let of = <#ty as Kind>::read(at)?;
                #(at.at_least(of.len(), #least)?;)*
                Ok(#ident(of))
            }
            fn write(&self) -> Node {
                Kind::write(&self.0)
            }
            fn check(&self, key: &Key) -> Result<(), Fault> {
                Kind::check(&self.0, &Key { #(least: #least,)* ..*key })?;
                #(#check(self, key)?;)*
                Ok(())
            }
            fn schema(key: &Key, defs: &mut Defs) -> Node {
                let key = Key { #(least: #least,)* ..*key };
                <#ty as Kind>::schema(&key, defs).described(#doc).with("x-type", #name.into())
            }
        }
    })
}
