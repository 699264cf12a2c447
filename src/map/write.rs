//! Maps as GraphML, GeoJSON, DOT and g2o.
//!
//! All carry the same: nodes with position (m), covariance (m²), probability and detections, edges
//! with weight and support. Coordinates are metres of the believed frame, in GeoJSON too, which
//! says so in a member of its own and names a local reference system. g2o has no place for
//! probabilities: nodes are `VERTEX_XY`, edges `EDGE_POINTXY` with the information of the
//! difference of the two nodes, taken as independent; the rest stands in comments.

use std::fmt::Write as _;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use serde_json::json;

use super::posterior::{Edge, Node, PosteriorMap};

/// A format of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// XML for graphs (networkx, Gephi, yEd).
    GraphMl,
    /// Points and lines (QGIS).
    GeoJson,
    /// Graphviz.
    Dot,
    /// Pose graphs (g2o).
    G2o,
}

impl MapFormat {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::GraphMl, Self::GeoJson, Self::Dot, Self::G2o];

    /// What a file's name ends in.
    pub fn extension(self) -> &'static str {
        match self {
            Self::GraphMl => "graphml",
            Self::GeoJson => "geojson",
            Self::Dot => "dot",
            Self::G2o => "g2o",
        }
    }

    /// The map as a text, under a name.
    pub fn text(self, map: &PosteriorMap, name: &str) -> String {
        match self {
            Self::GraphMl => graphml(map, name),
            Self::GeoJson => geojson(map, name),
            Self::Dot => dot(map, name),
            Self::G2o => g2o(map, name),
        }
    }
}

fn members(node: &Node) -> String {
    let members: Vec<String> = node.members.iter().map(ToString::to_string).collect();
    members.join(" ")
}

fn node_values(node: &Node) -> [(&'static str, f64); 6] {
    let ([x, y], [xx, xy, yy]) = (node.position_m, node.covariance_m2);
    [
        ("x", x),
        ("y", y),
        ("cov_xx", xx),
        ("cov_xy", xy),
        ("cov_yy", yy),
        ("probability", node.probability),
    ]
}

fn graphml(map: &PosteriorMap, name: &str) -> String {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 1);
    let written = write_graphml(&mut writer, map, name);
    written.expect("memory takes everything");
    let mut text = String::from_utf8(writer.into_inner()).expect("XML of texts is a text");
    text.push('\n');
    text
}

fn write_graphml(
    writer: &mut Writer<Vec<u8>>,
    map: &PosteriorMap,
    name: &str,
) -> Result<(), quick_xml::Error> {
    let datum = |writer: &mut Writer<Vec<u8>>, key: &str, value: &str| {
        let element = writer.create_element("data").with_attribute(("key", key));
        element.write_text_content(BytesText::new(value)).map(drop)
    };
    const NODE_KEYS: [&str; 6] = ["x", "y", "cov_xx", "cov_xy", "cov_yy", "probability"];
    let keys = NODE_KEYS.map(|key| (key, "node", "double")).into_iter();
    let keys = keys.chain([
        ("detections", "node", "string"),
        ("weight", "edge", "int"),
        ("support", "edge", "double"),
    ]);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let root = writer
        .create_element("graphml")
        .with_attribute(("xmlns", "http://graphml.graphdrawing.org/xmlns"));
    root.write_inner_content(|writer| {
        for (key, of, kind) in keys {
            let attributes = [
                ("id", key),
                ("for", of),
                ("attr.name", key),
                ("attr.type", kind),
            ];
            writer
                .create_element("key")
                .with_attributes(attributes)
                .write_empty()?;
        }
        let attributes = [("id", name), ("edgedefault", "undirected")];
        let graph = writer.create_element("graph").with_attributes(attributes);
        graph.write_inner_content(|writer| {
            for (id, node) in map.nodes.iter().enumerate() {
                let id = id.to_string();
                let element = writer.create_element("node");
                element
                    .with_attribute(("id", id.as_str()))
                    .write_inner_content(|writer| {
                        for (key, value) in node_values(node) {
                            datum(writer, key, &value.to_string())?;
                        }
                        datum(writer, "detections", &members(node))
                    })?;
            }
            for edge in &map.edges {
                let (source, target) = (edge.first.to_string(), edge.second.to_string());
                let ends = [("source", source.as_str()), ("target", target.as_str())];
                let element = writer.create_element("edge").with_attributes(ends);
                element.write_inner_content(|writer| {
                    datum(writer, "weight", &edge.weight.to_string())?;
                    datum(writer, "support", &edge.support.to_string())
                })?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

/// RFC 7946 knows degrees alone. The member `crs` is from the format before it, and still tells
/// GDAL, and so QGIS and geopandas, that coordinates are metres in a plane that lies nowhere on
/// Earth.
const LOCAL_METRES: &str = "LOCAL_CS[\"local metres\",UNIT[\"metre\",1]]";

fn geojson(map: &PosteriorMap, name: &str) -> String {
    let node = |(id, node): (usize, &Node)| {
        let mut properties = serde_json::Map::new();
        properties.insert("id".to_owned(), json!(id));
        for (key, value) in &node_values(node)[2..] {
            properties.insert((*key).to_owned(), json!(value));
        }
        properties.insert("detections".to_owned(), json!(node.members));
        json!({
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": node.position_m},
            "properties": properties,
        })
    };
    let edge = |edge: &Edge| {
        let at = |id: usize| map.nodes[id].position_m;
        json!({
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": [at(edge.first), at(edge.second)]},
            "properties": {
                "source": edge.first,
                "target": edge.second,
                "weight": edge.weight,
                "support": edge.support,
            },
        })
    };
    let nodes = map.nodes.iter().enumerate().map(node);
    let features: Vec<serde_json::Value> = nodes.chain(map.edges.iter().map(edge)).collect();
    let crs = json!({"type": "name", "properties": {"name": LOCAL_METRES}});
    let all = json!({
        "type": "FeatureCollection",
        "name": name,
        "crs": crs,
        "coordinate_units": "metres",
        "features": features,
    });
    format!("{all}\n")
}

/// A quoted string of DOT: only the quote and the backslash mean something in it.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

fn dot(map: &PosteriorMap, name: &str) -> String {
    let mut text = format!("graph {} {{\n  node [shape=circle];\n", quoted(name));
    for (id, node) in map.nodes.iter().enumerate() {
        let values = node_values(node).map(|(key, value)| format!("{key}={value}"));
        let ([x, y], members) = (node.position_m, quoted(&members(node)));
        // Graphviz places nodes by `pos`, in points, with `neato -n`; a metre is one inch.
        let at = format!("pos=\"{},{}\"", 72.0 * x, 72.0 * y);
        let _ = writeln!(
            text,
            "  {id} [{at}, {}, detections={members}];",
            values.join(", ")
        );
    }
    for edge in &map.edges {
        let Edge {
            first,
            second,
            weight,
            support,
        } = edge;
        let width = 1.0 + (*weight as f64).ln();
        let _ = writeln!(
            text,
            "  {first} -- {second} [weight={weight}, support={support}, penwidth={width}];"
        );
    }
    text.push_str("}\n");
    text
}

fn g2o(map: &PosteriorMap, name: &str) -> String {
    // A line break would end the comment.
    let name: String = name.chars().filter(|c| !c.is_control()).collect();
    let mut text = format!("# {name}: topometric map, nodes as points, metres\n");
    for (id, node) in map.nodes.iter().enumerate() {
        let [x, y] = node.position_m;
        let _ = writeln!(
            text,
            "# probability {}, detections {}\nVERTEX_XY {id} {x} {y}",
            node.probability,
            members(node)
        );
    }
    for edge in &map.edges {
        let (a, b) = (&map.nodes[edge.first], &map.nodes[edge.second]);
        let [dx, dy] = [0, 1].map(|axis| b.position_m[axis] - a.position_m[axis]);
        let [xx, xy, yy] = [0, 1, 2].map(|k| a.covariance_m2[k] + b.covariance_m2[k]);
        let det = xx * yy - xy * xy;
        let information = [yy / det, -xy / det, xx / det].map(|value| value.to_string());
        let _ = writeln!(
            text,
            "# weight {}, support {}\nEDGE_POINTXY {} {} {dx} {dy} {}",
            edge.weight,
            edge.support,
            edge.first,
            edge.second,
            information.join(" ")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> PosteriorMap {
        let node = |x: f64, members: &[usize]| Node {
            position_m: [x, 0.5],
            covariance_m2: [0.5, 0.0, 0.25],
            members: members.to_vec(),
            probability: 0.75,
        };
        PosteriorMap {
            nodes: vec![node(0.0, &[0, 2]), node(4.0, &[1])],
            edges: vec![Edge {
                first: 0,
                second: 1,
                weight: 2,
                support: 1.0,
            }],
        }
    }

    #[test]
    fn texts_of_a_map() {
        let text = |format: MapFormat| format.text(&map(), "a \"b\" <c> & \\d");
        let graphml = text(MapFormat::GraphMl);
        assert!(
            graphml.contains("<graph id=\"a &quot;b&quot; &lt;c&gt; &amp; \\d\" "),
            "{graphml}"
        );
        assert!(graphml.contains("<data key=\"detections\">0 2</data>"));
        let json: serde_json::Value =
            serde_json::from_str(&text(MapFormat::GeoJson)).expect("JSON");
        assert_eq!(json["name"], "a \"b\" <c> & \\d");
        assert_eq!(json["crs"]["properties"]["name"], LOCAL_METRES);
        assert_eq!(json["coordinate_units"], "metres");
        assert_eq!(
            json["features"][2]["geometry"]["coordinates"],
            json!([[0.0, 0.5], [4.0, 0.5]])
        );
        assert_eq!(
            json["features"][0]["properties"]["detections"],
            json!([0, 2])
        );
        let dot = text(MapFormat::Dot);
        assert!(
            dot.starts_with("graph \"a \\\"b\\\" <c> & \\\\d\" {"),
            "{dot}"
        );
        assert!(dot.contains("  0 -- 1 [weight=2, support=1, "));
        let g2o = text(MapFormat::G2o);
        // Covariance of the difference: diag(1, ½).
        assert!(g2o.contains("\nEDGE_POINTXY 0 1 4 0 1 -0 2\n"), "{g2o}");
        assert!(g2o.contains("\nVERTEX_XY 1 4 0.5\n"));
    }
}
