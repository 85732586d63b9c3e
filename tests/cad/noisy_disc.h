#pragma once
// A STEP file written by hand as translators of CAD programs write theirs: numbers that are rounded, and so a vertex that
// lies 1e-13 mm beside the seam of its circle. OpenCASCADE 7.6 does not mesh the cone.
#include <string>
#include <vector>

namespace takt::test {

constexpr double kDiscRadius_mm = 13.0, kDiscHeight_mm = 7.0, kHoleRadius_mm = 5.0, kSinkRadius_mm = 11.0;

class NoisyDisc {
 public:
  /// A disc along x with a bore, countersunk at 45 deg. `noise_mm`: by how much its axis is off y = 0.
  explicit NoisyDisc(double noise_mm) : noise_(noise_mm) {}

  std::string text() {
    const double depth = kSinkRadius_mm - kHoleRadius_mm, s = 0.7071067811865475;
    const std::string back = direction(-1, 0, 0), ahead = direction(1, 0, 0), y = direction(0, -1, 0),
                      y_noisy = direction(0, -1, noise_);
    const std::string a = vertex(kDiscHeight_mm, kDiscRadius_mm), b = vertex(0, kDiscRadius_mm),
                      c = vertex(0, kSinkRadius_mm), d = vertex(kDiscHeight_mm, kHoleRadius_mm),
                      e = vertex(depth, kHoleRadius_mm);
    const std::string rim = circle(a, kDiscHeight_mm, kDiscRadius_mm, back, y),
                      rim_seam = line(a, b, 0, kDiscRadius_mm, back),
                      foot = circle(b, 0, kDiscRadius_mm, ahead, y),
                      sink = circle(c, 0, kSinkRadius_mm, back, y_noisy),
                      bore = circle(d, kDiscHeight_mm, kHoleRadius_mm, back, y_noisy),
                      bore_seam = line(d, e, 0, kHoleRadius_mm, back),
                      end = circle(e, depth, kHoleRadius_mm, back, y_noisy),
                      sink_seam = line(e, c, 0, kSinkRadius_mm, direction(-s, s, -noise_));
    const auto around = [&](const std::string& first, const std::string& seam, const std::string& second,
                            bool turned) {
      return loop({turned ? turn(first) : first, seam, second, turn(seam)});
    };
    const std::vector<std::string> faces{
        face({around(rim, rim_seam, foot, false)}, "CYLINDRICAL_SURFACE", placement(0, ahead, y),
             kDiscRadius_mm, true),
        face({loop({turn(foot)}), loop({turn(sink)})}, "PLANE", placement(0, ahead, y), 0, false),
        face({loop({turn(rim)}), loop({bore})}, "PLANE", placement(kDiscHeight_mm, back, y), 0, false),
        face({around(bore, bore_seam, end, true)}, "CYLINDRICAL_SURFACE", placement(0, back, y_noisy),
             kHoleRadius_mm, false),
        face({around(end, sink_seam, sink, true)}, "CONICAL_SURFACE", placement(0, back, y_noisy),
             kSinkRadius_mm, false)};
    return finished(add("MANIFOLD_SOLID_BREP('Disc'," + add("CLOSED_SHELL('',(" + list(faces) + "))") + ")"));
  }

 private:
  static std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.15E", value);
    return text;
  }
  static std::string list(const std::vector<std::string>& items) {
    std::string text;
    for (const std::string& item : items) text += (text.empty() ? "" : ",") + item;
    return text;
  }
  std::string add(const std::string& entity) {
    data_ += "#" + std::to_string(++count_) + "=" + entity + ";\n";
    return "#" + std::to_string(count_);
  }
  std::string triple(double x, double y, double z) const {
    return "('',(" + number(x) + "," + number(y) + "," + number(z) + "))";
  }
  std::string point(double x, double y) { return add("CARTESIAN_POINT" + triple(x, y + noise_, 20.0)); }
  std::string direction(double x, double y, double z) { return add("DIRECTION" + triple(x, y, z)); }
  std::string vertex(double x, double y) { return add("VERTEX_POINT(''," + point(x, y) + ")"); }
  std::string placement(double x, const std::string& axis, const std::string& reference) {
    return add("AXIS2_PLACEMENT_3D(''," + point(x, 0) + "," + axis + "," + reference + ")");
  }
  std::string edge(const std::string& from, const std::string& to, const std::string& curve) {
    return add("ORIENTED_EDGE('',*,*," + add("EDGE_CURVE(''," + from + "," + to + "," + curve + ",.T.)") +
               ",.T.)");
  }
  /// The same edge, run through backwards.
  std::string turn(const std::string& edge) {
    const std::size_t at = data_.find("\n" + edge + "=ORIENTED_EDGE") + 1, end = data_.find(';', at);
    std::string entity = data_.substr(at, end - at);
    entity = entity.substr(entity.find('=') + 1);
    return add(entity.replace(entity.rfind(".T."), 3, ".F."));
  }
  std::string circle(const std::string& at, double x, double radius, const std::string& axis,
                     const std::string& reference) {
    return edge(at, at, add("CIRCLE(''," + placement(x, axis, reference) + "," + number(radius) + ")"));
  }
  std::string line(const std::string& from, const std::string& to, double x, double y,
                   const std::string& along) {
    return edge(from, to, add("LINE(''," + point(x, y) + "," + add("VECTOR(''," + along + ",1.)") + ")"));
  }
  std::string loop(const std::vector<std::string>& edges) {
    return add("EDGE_LOOP('',(" + list(edges) + "))");
  }
  std::string face(const std::vector<std::string>& loops, const std::string& kind, const std::string& place,
                   double radius, bool same) {
    std::vector<std::string> bounds;
    for (const std::string& one : loops)
      bounds.push_back(add((bounds.empty() ? "FACE_OUTER_BOUND(''," : "FACE_BOUND('',") + one + ",.T.)"));
    const std::string surface = add(kind + "(''," + place + (radius > 0 ? "," + number(radius) : "") +
                                    (kind == "CONICAL_SURFACE" ? ",0.785398163397449" : "") + ")");
    return add("ADVANCED_FACE('',(" + list(bounds) + ")," + surface + (same ? ",.T.)" : ",.F.)"));
  }
  std::string finished(const std::string& solid) {
    const std::string mm = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"),
                      rad = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))"),
                      sr = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    const std::string context = add(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((" +
        add("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.01)," + mm + ",'DISTANCE_ACCURACY_VALUE','')") +
        "))GLOBAL_UNIT_ASSIGNED_CONTEXT((" + mm + "," + rad + "," + sr +
        "))REPRESENTATION_CONTEXT('','3D'))");
    const std::string shape = add("ADVANCED_BREP_SHAPE_REPRESENTATION('',(" + solid + ")," + context + ")"),
                      application = add("APPLICATION_CONTEXT('automotive design')"),
                      product = add("PRODUCT('Disc','Disc','',(" +
                                    add("PRODUCT_CONTEXT(''," + application + ",'mechanical')") + "))"),
                      version = add("PRODUCT_DEFINITION_FORMATION('',''," + product + ")"),
                      life =
                          add("PRODUCT_DEFINITION_CONTEXT('part definition'," + application + ",'design')"),
                      definition = add("PRODUCT_DEFINITION('',''," + version + "," + life + ")");
    add("SHAPE_DEFINITION_REPRESENTATION(" + add("PRODUCT_DEFINITION_SHAPE('',''," + definition + ")") + "," +
        shape + ")");
    return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
           "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }'));\nENDSEC;\nDATA;" +
           data_ + "ENDSEC;\nEND-ISO-10303-21;\n";
  }

  const double noise_;
  std::string data_ = "\n";
  int count_ = 0;
};

}  // namespace takt::test
