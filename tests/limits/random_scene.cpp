// SPDX-License-Identifier: Apache-2.0
// Texts are made in statements of their own, as the order of arguments is the C++ compiler's choice; that of braces is
// not.
#include "limits/random_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "model/methods.h"
#include "support/split_mix.h"

namespace dpde::testing {

namespace {

enum class Geometry { plain, stretched, annulus, disc, sphere, cylinder, metric };

/// How often a time method is drawn; 1 for methods without a row.
int weight_of(const model::TimeMethod& method) {
  const std::map<std::string_view, int> weights = {{"euler", 5},      {"rk2", 4},    {"rk4", 5},   {"ssp_rk3", 3},
                                                   {"verlet", 3},     {"ab2", 3},    {"ab3", 3},   {"leapfrog", 3},
                                                   {"imex_euler", 2}, {"ars222", 2}, {"ars443", 2}};
  const auto found = weights.find(method.name);
  return found == weights.end() ? 1 : found->second;
}

struct Unknown {
  std::string name;
  bool is_vector = false, is_second = false;
};

class SceneBuilder {
 public:
  explicit SceneBuilder(std::uint64_t seed) : random_(seed) {}

  Part build() {
    choose();
    Part before{Part::Kind::fixed, "", {}}, model = before, scheme = before, scene = before;
    declare(model);
    for (const Unknown& unknown : unknowns_) equation(model, unknown);
    if (has_mask_) add(model, item("u = @ inside solid", {number(0.2, 0.9)}));
    rows(scheme);
    describe(scene);
    if (has_network_)
      before = item("network law(a) { real f64; initial he, seed 3; dense 3; tanh; dense out, gain = 0.5 }\n");
    return {Part::Kind::fixed,
            "@@@@",
            {before, block("model m", model), block("scheme q", scheme), block("scene s : m with q", scene)}};
  }

 private:
  void choose();
  void choose_axes();
  void choose_unknowns();
  void declare(Part& model);
  void equation(Part& model, const Unknown& unknown);
  void staggered_equations(Part& model);
  std::vector<Part> terms_of(const Unknown& unknown);
  Part any_term(const std::string& name);
  Part transport(const std::string& name);
  Part coupling(const std::string& name);
  Part factor();
  Part slope_of(const std::string& name);
  void rows(Part& scheme);
  void describe(Part& scene);
  void grids(Part& scene);
  void boundaries(Part& scene);
  void boundary(Part& scene, const std::string& name, bool is_second, int along);
  Part side(const std::string& name, bool is_second);
  void values(Part& scene);
  void events(Part& scene);

  static Part block(const std::string& head, const Part& body) {
    return {Part::Kind::fixed, head + " {\n@}\n", {body}};
  }
  static void add(Part& body, Part line) {
    line.text = "  " + line.text + "\n";
    body.text += "@";
    body.parts.push_back(std::move(line));
  }
  Part number(double low, double high) { return expression(fmt::format("{:.2f}", random_.uniform(low, high))); }
  template <class T>
  const T& any(const std::vector<T>& list) {
    return list[static_cast<std::size_t>(random_.below(static_cast<int>(list.size())))];
  }
  bool is_curved() const { return geometry_ != Geometry::plain && geometry_ != Geometry::stretched; }
  bool has_walls() const { return std::ranges::find(is_periodic_, false) != is_periodic_.end(); }
  bool has_pole() const { return geometry_ == Geometry::disc || geometry_ == Geometry::sphere; }
  bool is_explicit() const { return !is_implicit(time_) && !is_exponential(time_); }

  SplitMix random_;
  Geometry geometry_ = Geometry::plain;
  model::TimeScheme time_ = nullptr;
  int rank_ = 1;
  std::vector<std::string> axes_;
  std::vector<bool> is_periodic_;
  std::vector<Unknown> unknowns_;
  enum class Kind { fields, staggered, projected } kind_ = Kind::fields;
  bool has_solve_ = false, has_mask_ = false, has_network_ = false, has_coefficient_ = false, is_spectral_ = false,
       is_all_implicit_ = false, has_mean_ = false, has_stream_ = false, is_linear_ = false, is_split_ = false;
};

void SceneBuilder::choose() {
  int weights = 0;
  for (const model::TimeMethod& method : model::time_methods()) weights += weight_of(method);
  int draw = random_.below(weights);
  for (const model::TimeMethod& method : model::time_methods()) {
    if (time_ == nullptr && draw < weight_of(method)) time_ = &method;
    draw -= weight_of(method);
  }
  choose_axes();
  choose_unknowns();
  is_linear_ = random_.percent(60);
  const bool is_plain = geometry_ == Geometry::plain && kind_ == Kind::fields;
  is_spectral_ = is_exponential(time_) || (is_plain && !has_walls() && !is_implicit(time_) && random_.percent(15));
  is_all_implicit_ = is_implicit(time_) && kind_ == Kind::fields && !has_pole() &&
                     (std::string(time_->name) == "crank_nicolson" ? random_.percent(70) : random_.percent(30));
  has_solve_ = kind_ == Kind::fields && !is_all_implicit_ && !has_pole() && random_.percent(15);
  has_stream_ = has_solve_ && rank_ == 2 && geometry_ == Geometry::plain && random_.percent(50);
  has_coefficient_ = random_.percent(30);
  has_mask_ = kind_ == Kind::fields && is_explicit() && !is_spectral_ && std::string(time_->name) != "verlet" &&
              std::string(time_->name) != "leapfrog" && random_.percent(12);
  has_network_ = kind_ == Kind::fields && !is_all_implicit_ && random_.percent(6);
  has_mean_ = random_.percent(12) && !is_all_implicit_;
}

void SceneBuilder::choose_axes() {
  rank_ = random_.percent(65) ? 1 : 2;
  if (is_exponential(time_)) rank_ = 1;
  axes_ = {"x", "y"};
  const int kind = random_.weighted({70, 10, 5, 4, 5, 3, 3});
  geometry_ = is_exponential(time_) ? Geometry::plain : static_cast<Geometry>(kind);
  switch (geometry_) {
    case Geometry::annulus:
    case Geometry::disc: axes_ = {"r", "theta"}, is_periodic_ = {false, true}, rank_ = 2; break;
    case Geometry::sphere: axes_ = {"lon", "lat"}, is_periodic_ = {true, false}, rank_ = 2; break;
    case Geometry::cylinder: axes_ = {"r", "y"}, is_periodic_ = {false, random_.percent(50)}; break;
    case Geometry::metric: is_periodic_ = {true, false}, rank_ = 2; break;
    default:
      for (int axis = 0; axis < rank_; ++axis) is_periodic_.push_back(is_exponential(time_) || random_.percent(45));
  }
  axes_.resize(static_cast<std::size_t>(rank_));
  is_periodic_.resize(static_cast<std::size_t>(rank_));
}

void SceneBuilder::choose_unknowns() {
  const std::string time = time_->name;
  if (!is_curved() && is_explicit() && time != "verlet" && random_.percent(14)) {
    kind_ = rank_ == 2 && random_.percent(50) && !is_multistep(time_) ? Kind::projected : Kind::staggered;
    unknowns_ = {{"w", true}};
    if (kind_ == Kind::staggered) unknowns_.push_back({"h"});
    return;
  }
  const char* const names[] = {"u", "v", "c"};
  const int most = rank_ == 1 ? 3 : 2;
  const int count = std::min(most, 1 + random_.weighted({50, 35, 15}));
  for (int i = 0; i < count; ++i) {
    const bool is_second =
        (time == "verlet" && i == 0) || (is_explicit() && random_.percent(time == "leapfrog" ? 40 : 12));
    unknowns_.push_back({names[i], false, is_second});
  }
}

void SceneBuilder::declare(Part& model) {
  for (const Unknown& unknown : unknowns_) {
    const bool is_on_faces = unknown.is_vector;
    add(model, {Part::Kind::fixed,
                std::string(is_on_faces ? "vector " : "field ") + unknown.name + (is_on_faces ? " on faces" : ""),
                {}});
  }
  if (kind_ == Kind::projected) add(model, {Part::Kind::fixed, "field p", {}});
  if (has_coefficient_) add(model, item("coefficient k"));
  if (has_mask_) add(model, item("mask solid"));
  if (has_solve_ && has_stream_) add(model, item("solve lap(phi) = @ - u for phi", {number(-0.5, 0.5)}));
  if (has_solve_ && !has_stream_)
    add(model, item("solve @*phi - @*lap(phi) = u for phi", {number(0.5, 2), number(0.2, 2)}));
}

/// A positive factor of a term.
Part SceneBuilder::factor() {
  const int kind = random_.weighted({50, 14, is_linear_ ? 0 : 10, is_linear_ ? 0 : 14, has_coefficient_ ? 20 : 0});
  const std::string axis = any(axes_);
  switch (is_exponential(time_) || is_spectral_ ? (kind == 2 || kind == 4 ? 0 : kind) : kind) {
    case 1:
      return is_exponential(time_) ? number(0.2, 1.5) : expression("@*(1 + 0.4*sin(" + axis + "))", {number(0.2, 1.5)});
    case 2: return expression("@*(1 + 0.4*cos(3*t))", {number(0.2, 1.5)});
    case 3: return expression("@*(1 + 0.3*u^2)", {number(0.2, 1.5)});
    case 4: return expression("@*k", {number(0.2, 1.5)});
    default: return number(0.2, 1.5);
  }
}

Part SceneBuilder::slope_of(const std::string& name) {
  const std::string axis = any(axes_);
  if (is_curved()) return expression("@*" + name, {number(-1, 1)});
  return expression("@*d" + axis + "(" + name + ")", {number(0.2, 1.5)});
}

Part SceneBuilder::transport(const std::string& name) {
  std::vector<Part> parts;
  for (int axis = 0; axis < rank_; ++axis) {
    Part part = number(0.2, 1.5);
    if (!is_linear_ && random_.percent(25)) part = expression("@*u", {part});
    if (random_.percent(20) && !is_exponential(time_)) part = expression("@*(1 + 0.4*sin(" + axes_[0] + "))", {part});
    if (has_pole() && axis == (geometry_ == Geometry::sphere ? 1 : 0)) part = expression("0");
    if (geometry_ == Geometry::sphere && axis == 0) part = expression("@*cos(lat)", {part});
    if (geometry_ == Geometry::disc && axis == 1) part = expression("@*r", {part});
    parts.push_back(part);
  }
  if (has_stream_ && random_.percent(70)) return expression("-advect((dy(phi), -dx(phi)), " + name + ")");
  if (rank_ == 1) return expression("-advect(@, " + name + ")", {parts[0]});
  return expression("-advect((@, @), " + name + ")", {parts[0], parts[1]});
}

Part SceneBuilder::coupling(const std::string& name) {
  std::vector<std::string> others;
  for (const Unknown& other : unknowns_) {
    if (!other.is_vector && other.name != name) others.push_back(other.name);
  }
  if (others.empty()) return expression("-@*" + name, {factor()});
  const std::string other = any(others);
  switch (random_.below(is_linear_ ? 3 : 5)) {
    case 0: return expression("@*" + other, {number(-1, 1)});
    case 1: return slope_of(other);
    case 2: return expression("@*(" + other + " - " + name + ")", {factor()});
    case 3: return expression("@*" + name + "*" + other, {number(-1, 0.3)});
    default: return expression("@*sin(" + other + ")", {number(-1, 1)});
  }
}

Part SceneBuilder::any_term(const std::string& name) {
  const int kind = random_.weighted({30, 25, 12, 16, has_mean_ ? 25 : 0, has_solve_ ? 25 : 0, has_network_ ? 30 : 0,
                                     is_curved() || is_implicit(time_) ? 0 : 4, is_linear_ ? 0 : 8});
  switch (kind) {
    case 0: {
      const bool is_flux = !is_spectral_ && random_.percent(30);
      return expression(is_flux ? "div(@*grad(" + name + "))" : "@*lap(" + name + ")", {factor()});
    }
    case 1: return transport(name);
    case 2: return expression("-@*" + name, {factor()});
    case 3: return coupling(name);
    case 4:
      switch (random_.below(is_linear_ ? 2 : 3)) {
        case 0: return expression("-@*mean(" + name + ")", {number(0.2, 2)});
        case 1: return expression("@*(mean(" + name + ", " + any(axes_) + ") - " + name + ")", {number(0.2, 2)});
        default: return expression("-@*mean(" + name + "^2)*" + name, {number(0.2, 2)});
      }
    case 5: return expression("@*phi", {number(-1, 1)});
    case 6: return expression("@*law(" + name + ")", {number(-1, 1)});
    case 7: return expression("-@*lap(lap(" + name + "))", {number(0.05, 0.5)});
    default: return expression("@*" + name + "*(1 - " + name + ")", {number(0.1, 1)});
  }
}

std::vector<Part> SceneBuilder::terms_of(const Unknown& unknown) {
  std::vector<Part> terms;
  const bool is_nicolson = std::string(time_->name) == "crank_nicolson" && !is_all_implicit_;
  if (unknown.is_second) {
    terms.push_back(expression("@*lap(" + unknown.name + ")", {factor()}));
    if (random_.percent(50)) terms.push_back(expression("-@*dt(" + unknown.name + ")", {number(0.1, 1)}));
    if (random_.percent(30)) terms.push_back(coupling(unknown.name));
    return terms;
  }
  if (is_implicit(time_) || is_exponential(time_) || is_nicolson) {
    Part k = number(0.2, 1.5);
    if (has_coefficient_ && is_implicit(time_)) k = expression("@*k", {k});
    terms.push_back(expression("@*lap(" + unknown.name + ")", {k}));
    if (is_nicolson) return terms;
  }
  const int count = 1 + random_.weighted({4, 4, 2});
  for (int i = 0; i < count; ++i) terms.push_back(any_term(unknown.name));
  if (random_.percent(15) && !is_nicolson) terms.push_back(expression("sin(t)"));
  return terms;
}

void SceneBuilder::staggered_equations(Part& model) {
  if (kind_ == Kind::projected) {
    std::vector<Part> sides{expression("@*lap(w) - grad(p)", {number(0.2, 1)})};
    if (random_.percent(60)) {
      const Part a = number(0.2, 1), b = number(0.2, 1);
      const Part flow = is_linear_ ? expression("(@, @)", {a, b}) : expression("w");
      sides[0] = expression("@ - advect(@, w)", {sides[0], flow});
    }
    add(model, {Part::Kind::fixed, "dt(w) = @", sides});
    add(model, {Part::Kind::fixed, "0 = div(w) gives p", {}});
    return;
  }
  Part push = expression("-@*grad(h)", {number(0.3, 2)}), gain = expression("-@*div(w)", {number(0.3, 2)});
  if (!is_linear_ && random_.percent(50)) gain = expression("-div((1 + 0.3*interpolate(h))*w)");
  if (random_.percent(40)) push = expression("@ + @*lap(w)", {push, number(0.1, 1)});
  if (random_.percent(30)) gain = expression("@ + @*lap(h)", {gain, number(0.1, 1)});
  if (random_.percent(30)) push = expression("@ - @*w", {push, number(0.1, 1)});
  if (rank_ == 2 && random_.percent(25)) {
    add(model, {Part::Kind::fixed, "dt(w) = @ + @*(interpolate(w.y), -interpolate(w.x))", {push, number(0.2, 1)}});
  } else {
    add(model, {Part::Kind::fixed, "dt(w) = @", {push}});
  }
  add(model, {Part::Kind::fixed, "dt(h) = @", {gain}});
}

void SceneBuilder::equation(Part& model, const Unknown& unknown) {
  if (kind_ != Kind::fields) {
    if (unknown.is_vector) staggered_equations(model);
    return;
  }
  std::vector<Part> terms = terms_of(unknown);
  Part sum = std::move(terms[0]);
  for (std::size_t i = 1; i < terms.size(); ++i)
    sum = expression("@ + @", {std::move(sum), expression("(@)", {std::move(terms[i])})});
  const std::string left = unknown.is_second ? "dt(dt(" + unknown.name + "))" : "dt(" + unknown.name + ")";
  add(model, {Part::Kind::fixed, left + " = @", {std::move(sum)}});
}

void SceneBuilder::rows(Part& scheme) {
  add(scheme, {Part::Kind::fixed, std::string("time = ") + time_->name, {}});
  const auto order = [&] { return fmt::format("central({})", 2 + 2 * random_.weighted({6, 3, 1, 1})); };
  if (is_spectral_) {
    for (const char* key : {"dx", "lap", "advect"}) add(scheme, item(std::string(key) + " = spectral"));
    if (!is_exponential(time_) && random_.percent(25)) add(scheme, item("dealias = two_thirds"));
  } else {
    const std::vector<std::string> winds = {"upwind(1)", "upwind(3)", "upwind(5)", "upwind(7)"};
    const bool is_central = kind_ != Kind::fields || random_.percent(50);
    std::string advect = is_central ? order() : any(winds);
    const bool may_flow = is_explicit() && !is_multistep(time_) && std::string(time_->name) != "verlet" && !has_pole();
    if (may_flow && kind_ == Kind::fields && random_.percent(5)) advect = "semi_lagrangian";
    if (random_.percent(4)) advect = random_.percent(50) ? "muscl(minmod)" : "weno(3)";
    add(scheme, item("advect = " + advect));
    if (random_.percent(50)) add(scheme, item("dx = " + (is_curved() ? std::string("central(2)") : order())));
    if (random_.percent(50)) add(scheme, item("lap = " + (is_curved() ? std::string("central(2)") : order())));
  }
  if (is_all_implicit_) add(scheme, item(random_.percent(60) ? "implicit = all" : "implicit = all_but_advect"));
  const bool may_split = is_explicit() && !is_multistep(time_) && std::string(time_->name) != "verlet";
  if (may_split && kind_ == Kind::fields && random_.percent(10)) {
    const std::vector<std::string> splits = {"lie(advect, sources, diffusion)", "strang(advect, sources, diffusion)",
                                             "strang(sources, diffusion, advect)"};
    is_split_ = true;
    add(scheme, item("split = " + any(splits)));
  }
}

void SceneBuilder::grids(Part& scene) {
  switch (geometry_) {
    case Geometry::annulus:
    case Geometry::disc: add(scene, {Part::Kind::fixed, "coordinates polar", {}}); break;
    case Geometry::sphere: add(scene, {Part::Kind::fixed, "coordinates sphere(1.5)", {}}); break;
    case Geometry::cylinder: add(scene, {Part::Kind::fixed, "coordinates cylinder", {}}); break;
    case Geometry::metric: add(scene, {Part::Kind::fixed, "coordinates metric(1 + 0.3*sin(y), 1.2)", {}}); break;
    default: break;
  }
  const int most = rank_ == 1 ? std::min(20, 36 / static_cast<int>(unknowns_.size())) : 3;
  for (int i = 0; i < rank_; ++i) {
    int cells = 4 + random_.below(most);
    const double width = random_.uniform(0.5, 1.5);
    std::string range = fmt::format("0 .. {:.2f}", cells * width);
    if (geometry_ == Geometry::annulus) range = i == 0 ? "1 .. 3" : "0 .. 2*pi";
    if (geometry_ == Geometry::disc) range = i == 0 ? "0 .. 2" : "0 .. 2*pi";
    if (geometry_ == Geometry::sphere) range = i == 0 ? "0 .. 2*pi" : "-pi/2 .. pi/2";
    if (is_curved() && is_periodic_[static_cast<std::size_t>(i)]) cells = 4 + 2 * random_.below(2);
    std::string line = fmt::format("grid {} = {}, cells {}", axes_[static_cast<std::size_t>(i)], range, cells);
    if (is_periodic_[static_cast<std::size_t>(i)]) line += ", periodic";
    if (geometry_ == Geometry::stretched && i == 0)
      line += fmt::format(", stretched x + {1:.2f}*sin(2*pi*x/{0:.2f})/(2*pi)", cells * width, 0.4 * cells * width);
    add(scene, {Part::Kind::fixed, line, {}});
  }
}

Part SceneBuilder::side(const std::string& name, bool is_second) {
  const bool may_radiate =
      is_second && std::string(time_->name) != "leapfrog" && geometry_ == Geometry::plain && !is_split_;
  const bool may_feel = !is_second && is_explicit() && !is_multistep(time_) && !is_split_ && kind_ == Kind::fields;
  switch (random_.weighted({5, 4, 2, 3, 2, may_radiate ? 5 : 0, may_feel ? 2 : 0})) {
    case 0: return expression("@", {number(-0.5, 1)});
    case 1: return expression("zero_gradient");
    case 2: return expression("gradient(@)", {number(-0.5, 0.5)});
    case 3: return expression("mixed(@, @, @)", {number(0.2, 2), number(0.2, 2), number(-0.5, 0.5)});
    case 4: return expression(is_second ? "zero_gradient" : "linear");
    case 5: return expression("radiating(@)", {number(0.3, 2)});
    default: return expression("gradient(-@*" + name + ")", {number(0.1, 1)});
  }
}

void SceneBuilder::boundary(Part& scene, const std::string& name, bool is_second, int along) {
  Part sides{Part::Kind::list, "", {}};
  for (int axis = 0; axis < rank_; ++axis) {
    if (is_periodic_[static_cast<std::size_t>(axis)]) continue;
    for (const char* end : {".low", ".high"}) {
      const std::string at = axes_[static_cast<std::size_t>(axis)] + end;
      const bool is_low = std::string(end) == ".low";
      Part value = name == "phi" || kind_ == Kind::projected ? expression(random_.percent(50) ? "0" : "zero_gradient")
                                                             : side(name, is_second);
      if (kind_ != Kind::fields) value = expression(along == axis ? "0" : "zero_gradient");
      if (geometry_ == Geometry::sphere || (geometry_ == Geometry::disc && is_low))
        value = {Part::Kind::fixed, "pole", {}};
      if (geometry_ == Geometry::cylinder && axis == 0 && is_low) value = expression("zero_gradient");
      sides.parts.push_back({Part::Kind::fixed, at + " = @", {value}});
    }
  }
  add(scene, {Part::Kind::fixed, "boundary " + name + ": @", {sides}});
}

void SceneBuilder::boundaries(Part& scene) {
  if (!has_walls()) return;
  for (const Unknown& unknown : unknowns_) {
    if (!unknown.is_vector) boundary(scene, unknown.name, unknown.is_second, -1);
    for (int axis = 0; unknown.is_vector && axis < rank_; ++axis)
      boundary(scene, unknown.name + "." + axes_[static_cast<std::size_t>(axis)], false, axis);
  }
  if (has_solve_) boundary(scene, "phi", false, -1);
}

void SceneBuilder::values(Part& scene) {
  const std::string axis = axes_[0], last = axes_.back();
  if (has_coefficient_) add(scene, item("k = 1 + @*cos(" + last + ")", {number(0.1, 0.6)}));
  if (has_mask_) add(scene, item("solid = " + axis + " < @", {number(0.5, 3)}));
  for (const Unknown& unknown : unknowns_) {
    const auto value = [&] {
      return expression("@ + @*sin(" + axis + ")*cos(" + last + ")", {number(0.2, 1.2), number(0.1, 0.5)});
    };
    if (unknown.is_vector) {
      std::vector<Part> parts;
      for (int i = 0; i < rank_; ++i) parts.push_back(value());
      const Part tuple = rank_ == 1 ? parts[0] : expression("(@, @)", {parts[0], parts[1]});
      add(scene, {Part::Kind::fixed,
                  rank_ == 1 ? "initial " + unknown.name + ".x = @" : "initial " + unknown.name + " = @",
                  {tuple}});
    } else {
      add(scene, {Part::Kind::fixed, "initial " + unknown.name + " = @", {value()}});
    }
    if (unknown.is_second) add(scene, {Part::Kind::fixed, "initial dt(" + unknown.name + ") = 0", {}});
  }
}

void SceneBuilder::events(Part& scene) {
  if (is_multistep(time_) || kind_ != Kind::fields || !random_.percent(15)) return;
  switch (random_.below(4)) {
    case 0: return add(scene, item("after step: u = @*u", {number(0.7, 1.1)}));
    case 1: return add(scene, item("after step: u += @*(0.5 - u)", {number(0.1, 0.9)}));
    case 2:
      return add(scene,
                 item("after step: u = " + unknowns_.back().name + "*@ + @", {number(0.3, 0.9), number(0, 0.4)}));
    default: return add(scene, item("every 0.1: u = 3*u"));  // no verdict is of the steps that have it
  }
}

void SceneBuilder::describe(Part& scene) {
  grids(scene);
  boundaries(scene);
  values(scene);
  events(scene);
  add(scene, {Part::Kind::fixed, "time 0 .. 2, step 0.05", {}});
  const bool may_be_parted =
      is_explicit() && !is_multistep(time_) && !is_split_ && kind_ == Kind::fields && unknowns_.size() > 1;
  if (may_be_parted && random_.percent(15))
    add(scene, item(fmt::format("subcycle {} in {}", unknowns_.back().name, 2 + random_.below(2))));
}

}  // namespace

Part random_scene(std::uint64_t seed) { return SceneBuilder(seed).build(); }

}  // namespace dpde::testing
