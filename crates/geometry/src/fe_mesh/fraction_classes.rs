//! Elements in classes of the solid fraction, each with a material of its own.

/// Number of classes.
const CLASSES: usize = 20;

/// The classes that elements of these solid fractions make: names, `FRACTION_005` to `FRACTION_100` by the upper end in percent, and elements.
/// Ascending; none is empty.
pub fn fraction_classes(fractions: &[f64]) -> Vec<(String, Vec<usize>)> {
    let mut classes: Vec<(String, Vec<usize>)> =
        (1..=CLASSES).map(|c| (format!("FRACTION_{:03}", c * 100 / CLASSES), Vec::new())).collect();
    for (i, fraction) in fractions.iter().enumerate() {
        let class = ((fraction * CLASSES as f64).ceil() as usize).clamp(1, CLASSES);
        classes[class - 1].1.push(i);
    }
    classes.retain(|(_, of)| !of.is_empty());
    classes
}
