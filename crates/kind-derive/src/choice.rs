//! Enums: one of several kinds.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{DataEnum, Error, Fields, Ident, Type, Variant};

use crate::attributes::{FieldAttributes, TypeAttributes};
use crate::table::kind_of_table;

/// The one field of a variant.
fn one(variant: &Variant) -> syn::Result<&Type> {
    match &variant.fields {
        Fields::Unnamed(f) if f.unnamed.len() == 1 => Ok(&f.unnamed[0].ty),
        _ => Err(Error::new_spanned(variant, "a variant has one field here")),
    }
}

fn boxed(ty: &Type) -> bool {
    matches!(ty, Type::Path(p) if p.path.segments.last().is_some_and(|s| s.ident == "Box"))
}

/// A table named by its kind, or a word.
pub fn tagged(ident: &Ident, outer: &TypeAttributes, data: &DataEnum) -> syn::Result<TokenStream> {
    let (mut choices, mut reads, mut writes, mut checks) = (vec![], vec![], vec![], vec![]);
    let (mut parts, mut keys) = (vec![], vec![]);
    let (mut members, mut from) = (vec![], vec![]);
    for variant in &data.variants {
        let (v, inner) = (&variant.ident, FieldAttributes::of(&variant.attrs)?);
        let name = inner.key.clone().unwrap_or_else(|| v.to_string().to_lowercase());
        let key = inner.describe(&name, true);
        if matches!(variant.fields, Fields::Unit) {
            choices.push(quote! { Choice { key: #key, word: true } });
            reads.push(quote! { #name => Ok(#ident::#v) });
            writes.push(quote! { #ident::#v => Value::Text(#name.into()).into() });
            checks.push(quote! { #ident::#v => Ok(()) });
            keys.push(quote! { #ident::#v => #name });
            continue;
        }
        let ty = one(variant)?;
        choices.push(quote! { Choice { key: #key, word: false } });
        reads.push(quote! { #name => Kind::read(&at).map(#ident::#v) });
        from.push(quote! { #name => Kind::read(&at).map(#ident::#v) });
        writes.push(quote! { #ident::#v(of) => Value::Table(vec![(#name.into(), None, Kind::write(of))]).into() });
        let limits = if outer.inherit {
            quote! { key }
        } else {
            quote! { &#key }
        };
        checks.push(quote! { #ident::#v(of) => Kind::check(of, #limits).map_err(|f| f.under(#name)) });
        parts.push(quote! { OpenTable::named::<#ty>(#key, defs) });
        keys.push(quote! { #ident::#v(_) => #name });
        members.push(if boxed(ty) {
            quote! { #ident::#v(of) => &**of }
        } else {
            quote! { #ident::#v(of) => of }
        });
    }
    let (name, doc) = (&outer.name, &outer.doc);
    let noun = outer.noun.clone().unwrap_or_else(|| ident.to_string().to_lowercase());
    let (check, before) = (outer.check.iter(), outer.before.iter());
    let family = outer.family.iter().map(|family| {
        quote! {
            /// The kind, as one of its family.
            pub(crate) fn family(&self) -> &dyn #family {
                match self { #(#members),* }
            }
        }
    });
    let key = (outer.keyed || outer.family.is_some()).then(|| {
        quote! {
            /// The key of the kind.
            pub fn key(&self) -> &'static str {
                match self { #(#keys),* }
            }
        }
    });
    let family = match &key {
        Some(key) => quote! { impl #ident { #key #(#family)* } },
        None => quote! {},
    };
    let table = if from.is_empty() {
        quote! {}
    } else {
        quote! {
            impl Table for #ident {
                fn keys() -> Vec<Key> {
                    CHOICES.iter().filter(|c| !c.word).map(|c| Key { required: false, ..c.key }).collect()
                }
                fn from_fields(fields: &Fields) -> Result<Self, DesignError> {
                    let (key, at) = fields.one_of(#noun, &Self::keys())?;
                    match key { #(#from,)* _ => Err(at.unknown_kind(#noun, CHOICES)) }
                }
                fn put(&self, out: &mut Vec<(String, Option<usize>, Node)>) {
                    if let Value::Table(entries) = self.write().value {
                        out.extend(entries);
                    }
                }
                fn open(defs: &mut Defs, out: &mut OpenTable) {
                    out.choices(vec![#(#parts),*]);
                }
            }
        }
    };
    Ok(quote! {
        const CHOICES: &[Choice] = &[#(#choices),*];
        #family
        #table
        impl Kind for #ident {
            const DOC: &'static str = #doc;
            fn expected() -> String {
                expected_choice(#noun, CHOICES)
            }
            fn fits(node: &Node) -> u8 {
                fits_choice(node, CHOICES)
            }
            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                #(#before(at)?;)*
                let (key, at) = at.choice(#noun, CHOICES)?;
                match key { #(#reads,)* _ => Err(at.unknown_kind(#noun, CHOICES)) }
            }
            fn write(&self) -> Node {
                match self { #(#writes),* }
            }
            fn check(&self, key: &Key) -> Result<(), Fault> {
                match self { #(#checks),* }?;
                #(#check(self, key)?;)*
                Ok(())
            }
            fn schema(_: &Key, defs: &mut Defs) -> Node {
                defs.named(#name, |defs| choice_schema(#doc, CHOICES, vec![#(#parts),*]))
            }
        }
    })
}

/// The variant follows from the type of the value.
pub fn untagged(ident: &Ident, outer: &TypeAttributes, data: &DataEnum) -> syn::Result<TokenStream> {
    let names: Vec<&Ident> = data.variants.iter().map(|v| &v.ident).collect();
    let types = data.variants.iter().map(one).collect::<syn::Result<Vec<_>>>()?;
    let docs = data.variants.iter().map(|v| Ok(FieldAttributes::of(&v.attrs)?.doc)).collect::<syn::Result<Vec<_>>>()?;
    let doc = &outer.doc;
    let (check, before) = (outer.check.iter(), outer.before.iter());
    let expected = match &outer.noun {
        Some(noun) => quote! { #noun.into() },
        None => quote! { [#(<#types as Kind>::expected()),*].join(" or ") },
    };
    Ok(quote! {
        impl Kind for #ident {
            const DOC: &'static str = #doc;
            fn expected() -> String {
                #expected
            }
            fn fits(node: &Node) -> u8 {
                0 #(.max(<#types as Kind>::fits(node)))*
            }
            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                #(#before(at)?;)*
                let best = Self::fits(at.node);
                if let (Value::List(items), 1) = (&at.node.value, best) {
                    let found = geometry::fault::counted(items.len(), "value");
                    return Err(at.error(format!("expected {}, found {found}", Self::expected())));
                }
                #(if best > 0 && <#types as Kind>::fits(at.node) == best {
                    return Kind::read(at).map(#ident::#names);
                })*
                Err(at.expected(&Self::expected()))
            }
            fn write(&self) -> Node {
                match self { #(#ident::#names(of) => Kind::write(of)),* }
            }
            fn check(&self, key: &Key) -> Result<(), Fault> {
                match self { #(#ident::#names(of) => Kind::check(of, key)),* }?;
                #(#check(self, key)?;)*
                Ok(())
            }
            fn schema(key: &Key, defs: &mut Defs) -> Node {
                let choices = vec![#(<#types as Kind>::schema(key, defs).described(#docs)),*];
                any_schema(#doc, choices)
            }
        }
    })
}

/// The variant follows from the keys that are given.
pub fn alternatives(ident: &Ident, outer: &TypeAttributes, data: &DataEnum) -> syn::Result<TokenStream> {
    let names: Vec<&Ident> = data.variants.iter().map(|v| &v.ident).collect();
    let types = data.variants.iter().map(one).collect::<syn::Result<Vec<_>>>()?;
    let docs = data.variants.iter().map(|v| Ok(FieldAttributes::of(&v.attrs)?.doc)).collect::<syn::Result<Vec<_>>>()?;
    let places = (0..names.len()).collect::<Vec<_>>();
    let checks = quote! { match self { #(#ident::#names(of) => Kind::check(of, key)),* }?; };
    let kind = kind_of_table(ident, outer, &checks);
    Ok(quote! {
        impl Table for #ident {
            fn keys() -> Vec<Key> {
                union_of_keys(vec![#(<#types as Table>::keys()),*])
            }
            fn from_fields(fields: &Fields) -> Result<Self, DesignError> {
                match fields.alternative(&[#(<#types as Table>::keys()),*])? {
                    #(#places => Table::from_fields(fields).map(#ident::#names),)*
                    _ => Err(fields.at.expected(&Self::expected())),
                }
            }
            fn put(&self, out: &mut Vec<(String, Option<usize>, Node)>) {
                match self { #(#ident::#names(of) => Table::put(of, out)),* }
            }
            fn open(defs: &mut Defs, out: &mut OpenTable) {
                out.choices(vec![#(OpenTable::of::<#types>(defs).described(#docs)),*]);
            }
        }
        #kind
    })
}
