//! Figures of the layers of a part.

use geometry::layer::Layer;
use schemars::JsonSchema;
use serde::Serialize;

/// What a file of layers holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct LayersReport {
    /// Number of layers.
    pub layers: usize,
    /// The sum of area times thickness over the layers, mm³: each area is that of the section in the layer's middle.
    pub volume: f64,
    /// Number of contours, holes included.
    pub contours: usize,
    /// Number of points of all contours.
    pub points: usize,
    /// Layers without a contour.
    pub empty: usize,
    /// The largest area of a layer, mm².
    pub largest: f64,
}

impl LayersReport {
    /// Adds the figures of a layer.
    pub fn add(&mut self, layer: &LayersReport) {
        self.layers += layer.layers;
        self.volume += layer.volume;
        self.contours += layer.contours;
        self.points += layer.points;
        self.empty += layer.empty;
        self.largest = self.largest.max(layer.largest);
    }
}

impl From<&Layer> for LayersReport {
    fn from(layer: &Layer) -> LayersReport {
        let area = layer.area();
        LayersReport {
            layers: 1,
            volume: area * layer.height(),
            contours: layer.loops.len(),
            points: layer.loops.iter().map(Vec::len).sum(),
            empty: usize::from(layer.loops.is_empty()),
            largest: area,
        }
    }
}
