// SPDX-License-Identifier: Apache-2.0
// Texts are made in statements of their own, as the order of arguments is the C++ compiler's choice; that of braces is
// not.
#include "random/random_model.h"

#include <fmt/format.h>

#include <algorithm>

#include "random/model_expression.h"
#include "random/model_ties.h"
#include "random/random_scheme.h"

namespace dpde::testing {

namespace {

constexpr double step = 0.02;

class ModelBuilder {
 public:
  explicit ModelBuilder(std::uint64_t seed)
      : random_(seed),
        ties_(~seed ^ 0xd6e8feb86659fd93),
        lines_(~seed ^ 0x8ebc6af09c88c6e3),
        parts_(~seed ^ 0x2545f4914f6cdd1d),
        expressions_(random_, names_) {}

  Part build() {
    choose_axes();
    scheme_ = random_scheme(random_, parts_);
    Part model{Part::Kind::fixed, "", {}}, scene = model, task = model;
    declare(model);
    Part helpers = functions();
    equations(model);
    describe_scene(scene);
    describe_task(task);
    std::vector<std::string> fields;
    for (const Rated& rated : rated_) fields.push_back(rated.quantity.name);
    Part rows{Part::Kind::fixed, "", {}};
    for (const std::string& row : scheme_rows(scheme_, fields, random_, parts_)) add(rows, item(row));
    Part scheme = block("scheme q", rows);
    return {Part::Kind::fixed,
            "@@@@@",
            {helpers, block("model m", model), scheme, block("scene s : m with q", scene), block("task t : s", task)}};
  }

 private:
  struct Rated {
    Quantity quantity;
    bool is_second = false;
  };

  void choose_axes();
  void declare(Part& model);
  void declare_rated(Part& model);
  bool is_solved(int rated) const { return scheme_.solves && rated == 0; }
  void declare_given(Part& model);
  Part functions();
  void equations(Part& model);
  Part sum_of(std::vector<Part> terms);
  Part right_side(const Rated& rated);
  void add_tie(const Rated& rated, std::vector<Part>& terms);
  Part right_side_of_vector(const Rated& rated);
  void describe_scene(Part& scene);
  void grids(Part& scene);
  void values(Part& scene);
  void boundaries(Part& scene);
  Part side(const Quantity& quantity, std::size_t axis);
  Part wall_formula(std::size_t axis);
  void events(Part& scene);
  void duration(Part& scene);
  void describe_task(Part& task);
  Part distance();
  Part loss();
  std::string when();
  static Part block(const std::string& head, const Part& body) {
    return {Part::Kind::fixed, head + " {\n@}\n", {body}};
  }
  static void add(Part& body, Part line) {
    line.text = "  " + line.text + "\n";
    body.text += "@";
    body.parts.push_back(std::move(line));
  }
  int rank() const { return static_cast<int>(names_.axes.size()); }
  bool has_walls() const {
    return std::ranges::any_of(names_.axes, [](const Axis& a) { return !a.is_periodic; });
  }
  bool has_stretched() const { return std::ranges::any_of(names_.axes, &Axis::is_stretched); }
  std::vector<std::string> components(const Quantity& q) const {
    std::vector<std::string> names;
    for (int axis = 0; axis < rank(); ++axis)
      names.push_back(q.name + "." + names_.axes[static_cast<std::size_t>(axis)].name);
    return q.is_vector ? names : std::vector{q.name};
  }
  template <class T>
  const T& any(const std::vector<T>& list) {
    return list[static_cast<std::size_t>(random_.below(static_cast<int>(list.size())))];
  }

  SplitMix random_, ties_, lines_, parts_;
  Names names_;
  ModelExpressions expressions_;
  Scheme scheme_;
  std::vector<Rated> rated_;
  std::vector<Quantity> coefficients_, control_fields_;
  std::vector<std::string> params_, controls_;
  int steps_ = 2;
  bool has_ties_ = false;  // fields have mirror images beyond walls then, more often
};

void ModelBuilder::choose_axes() {
  const int rank = 1 + random_.weighted({50, 35, 15});
  for (int axis = 0; axis < rank; ++axis) {
    Axis made{std::string(1, "xyz"[axis]), random_.percent(50), random_.percent(6)};
    names_.axes.push_back(made);
  }
  steps_ = 1 + random_.below(4);
}

void ModelBuilder::declare_rated(Part& model) {
  const std::vector<std::string> names = {"u", "v", "c"};
  const bool staggers = random_.percent(30);
  for (int i = 0, count = 1 + random_.weighted({4, 4, 2}); i < count; ++i) {
    Quantity q{names[static_cast<std::size_t>(i)]};
    q.is_rated = true;
    q.is_vector = random_.percent(25) && !is_solved(i);
    std::string on;
    if (staggers && random_.percent(70)) {
      const int kind = random_.weighted({3, 1, q.is_vector ? 0 : 3});
      if (kind == 0 && q.is_vector) q.on = Quantity::On::faces, on = " on faces";
      if (kind == 1) on = " on nodes";
      if (kind == 1) std::fill_n(q.place.begin(), rank(), true);
      const int axis = random_.below(rank());
      if (kind == 2)
        q.place[static_cast<std::size_t>(axis)] = true,
        on = " on faces." + names_.axes[static_cast<std::size_t>(axis)].name;
    }
    const bool second = (scheme_.second_order && (i == 0 || random_.percent(50))) ||
                        (!scheme_.along_flow && scheme_.time != "leapfrog" && random_.percent(8));
    rated_.push_back({q, second && !q.is_vector && !is_solved(i)});
    if (scheme_.time == "verlet" && i == 0) rated_.back().is_second = true, rated_.back().quantity.is_vector = false;
    if (!rated_.back().quantity.is_vector && rated_.back().quantity.on == Quantity::On::faces)
      rated_.back().quantity.on = Quantity::On::one_place, on = "";
    add(model, item(std::string(rated_.back().quantity.is_vector ? "vector " : "field ") + q.name + on));
  }
}

void ModelBuilder::declare_given(Part& model) {
  if (random_.percent(40)) coefficients_.push_back({"k"});
  if (random_.percent(20)) coefficients_.push_back({"w", true});
  if (random_.percent(15)) control_fields_.push_back({"G"});
  for (std::vector<Quantity>* list : {&coefficients_, &control_fields_}) {
    for (Quantity& q : *list) {
      q.is_given = true;
      const Quantity& like = any(rated_).quantity;
      std::string on;
      if (!q.is_vector && like.is_vector == q.is_vector && like.place != centre && random_.percent(50)) {
        q.place = like.place;
        const auto axis = static_cast<std::size_t>(std::ranges::find(like.place, true) - like.place.begin());
        on = std::ranges::count(like.place, true) == rank() ? " on nodes" : " on faces." + names_.axes[axis].name;
      }
      const std::string kind = list == &coefficients_ ? "coefficient " : "control ";
      add(model, item(kind + (q.is_vector ? "vector " : list == &coefficients_ ? "" : "field ") + q.name + on));
    }
  }
}

void ModelBuilder::declare(Part& model) {
  declare_rated(model);
  declare_given(model);
  for (const char* name : {"a", "nu", "b"}) {
    if (random_.percent(50)) params_.push_back(name);
  }
  if (random_.percent(20)) controls_.push_back("F");
  for (const std::string& name : params_) add(model, item("param " + name));
  for (const std::string& name : controls_) add(model, item("control " + name));
  names_.numbers = params_;
  names_.numbers.insert(names_.numbers.end(), controls_.begin(), controls_.end());
  for (const Rated& rated : rated_) names_.quantities.push_back(rated.quantity);
  names_.quantities.insert(names_.quantities.end(), coefficients_.begin(), coefficients_.end());
  names_.quantities.insert(names_.quantities.end(), control_fields_.begin(), control_fields_.end());
  names_.reductions = random_.percent(25);
}

Part ModelBuilder::functions() {
  Part all;
  const auto put = [&](const std::string& text) {
    all.text += "@";
    all.parts.push_back(item(text + "\n"));
  };
  if (random_.percent(25)) {
    put("function f(p, q) = p*q/(2 + sin(p - q))");
    names_.functions.push_back("f");
  }
  if (random_.percent(12) && !has_stretched()) {
    constexpr const char* bodies[3][2] = {{"(g[+1] - g)/hx", "(g[-2] - g[+1]*g[-1])/hx"},
                                          {"(g[+1, 0] - g[0, -1])/hy", "g[+1, +1]*g - g[-1, 0]/hx"},
                                          {"(g[0, 0, +1] - g)/hz", "g[+1, 0, -1]*g[0, +1, 0]"}};
    const bool brings_adjoint = rank() == 1 && random_.percent(40) && std::ranges::all_of(rated_, [](const Rated& r) {
                                  return r.quantity.place == centre && r.quantity.on != Quantity::On::faces;
                                });
    if (brings_adjoint)
      put("operator op(g) order 1 = (g[+1]^2 - g)/hx\n  adjoint g_bar = (2*g*op_bar[-1] - op_bar)/hx");
    if (!brings_adjoint) put(std::string("operator op(g) order 1 = ") + bodies[rank() - 1][random_.below(2)]);
    names_.operators.push_back("op");
  }
  has_ties_ = ties_.percent(25) && !has_stretched();
  if (has_ties_) {
    std::vector<std::string> axes;
    for (const Axis& axis : names_.axes) axes.push_back(axis.name);
    put(tie_operator(ties_, axes));
  }
  return all;
}

/// A choice between neighbours, of the fields that lie where this one does.
void ModelBuilder::add_tie(const Rated& rated, std::vector<Part>& terms) {
  if (!has_ties_ || !ties_.percent(70)) return;
  std::vector<std::string> fields;
  for (const Rated& other : rated_) {
    if (!other.quantity.is_vector && other.quantity.place == rated.quantity.place)
      fields.push_back(other.quantity.name);
  }
  terms.push_back(tie_term(ties_, rated.quantity.name, fields));
}

Part ModelBuilder::sum_of(std::vector<Part> terms) {
  Part sum = std::move(terms[0]);
  for (std::size_t i = 1; i < terms.size(); ++i) {
    const char* form = random_.percent(60) ? "@ + @" : "@ - @";
    sum = expression(form, {std::move(sum), expression("(@)", {std::move(terms[i])})});
  }
  return sum;
}

Part ModelBuilder::right_side(const Rated& rated) {
  const Quantity& q = rated.quantity;
  std::vector<Part> terms;
  if (scheme_.solves && q.name == rated_.front().quantity.name)
    terms.push_back(expression("@*lap(@)", {expressions_.number(0.05, 0.4), expression(q.name)}));
  if (rated.is_second) {
    terms.push_back(expression("@*lap(@)", {expressions_.uniform(), expression(q.name)}));
    if (random_.percent(50)) terms.push_back(expression("@*dt(@)", {expressions_.uniform(), expression(q.name)}));
  }
  const bool moves = random_.percent(50) && !(rated.is_second && scheme_.time == "leapfrog") &&
                     !(scheme_.along_flow && rated.is_second);
  for (int count = 1 + random_.below(2); count > 0; --count)
    terms.push_back(expressions_.term(expression(q.name), q.place));
  add_tie(rated, terms);
  Part sum = sum_of(std::move(terms));
  return moves ? expression("-advect(@, " + q.name + ") + @", {expressions_.velocity(), std::move(sum)}) : sum;
}

Part ModelBuilder::right_side_of_vector(const Rated& rated) {
  const Quantity& q = rated.quantity;
  std::vector<Part> terms;
  for (int count = 1 + random_.below(2); count > 0; --count) terms.push_back(expressions_.vector_term(q));
  Part sum = sum_of(std::move(terms));
  return random_.percent(50) ? expression("-advect(@, " + q.name + ") + @", {expressions_.velocity(), std::move(sum)})
                             : sum;
}

void ModelBuilder::equations(Part& model) {
  if (random_.percent(20)) {
    const Quantity& like = any(rated_).quantity;
    if (!like.is_vector) {
      add(model, item("let l = @", {expressions_.differentiable(like.place, 2)}));
      names_.quantities.push_back({"l", false, Quantity::On::one_place, like.place, false, true});
    }
  }
  for (const Rated& rated : rated_) {
    const Quantity& q = rated.quantity;
    const std::string& name = q.name;
    if (q.is_vector && random_.percent(25)) {
      for (int axis = 0; axis < rank(); ++axis) {
        const std::string component = components(q)[static_cast<std::size_t>(axis)];
        const Part side = expressions_.term(expression(component), place_of(q, axis));
        add(model, item("dt(" + component + ") = @", {side}));
      }
    } else if (q.is_vector) {
      add(model, item("dt(" + name + ") = @", {right_side_of_vector(rated)}));
    } else {
      add(model, item((rated.is_second ? "dt(dt(" + name + "))" : "dt(" + name + ")") + " = @", {right_side(rated)}));
    }
  }
}

/// Long enough for steps to be stable on up to 11 cells, which certificates take.
void ModelBuilder::grids(Part& scene) {
  constexpr int most[] = {9, 5, 4};
  for (const Axis& axis : names_.axes) {
    const int cells = 1 + random_.below(most[rank() - 1]);
    const std::string extent =
        fmt::format("{:.2f}", std::max(cells * random_.uniform(0.8, 1.4), 3.5 + random_.uniform(0, 1)));
    std::string line = fmt::format("grid {} = 0 .. {}, cells @", axis.name, extent);
    if (axis.is_periodic) line += ", periodic";
    if (axis.is_stretched) line += fmt::format(", stretched {0} + 0.1*sin(2*pi*{0}/{1})", axis.name, extent);
    add(scene, item(line, {expression(fmt::format("{}", cells))}));
  }
}

/// Of what is the same along the axis, as it is at a wall.
Part ModelBuilder::wall_formula(std::size_t axis) {
  const std::string other = names_.axes[(axis + 1) % names_.axes.size()].name;
  switch (random_.below(5)) {
    case 0: return expressions_.uniform();
    case 1: return expression("@*sin(3*t + " + other + ")", {expressions_.uniform()});
    case 2: return expression("0.3*" + other + " + @", {expressions_.uniform()});
    default: return expressions_.number(-0.5, 1.5);
  }
}

Part ModelBuilder::side(const Quantity& quantity, std::size_t axis) {
  Part value = wall_formula(axis);
  const bool may_vary = quantity.place == centre && quantity.on == Quantity::On::one_place && !coefficients_.empty() &&
                        coefficients_[0].place == centre && !coefficients_[0].is_vector && random_.percent(15);
  if (may_vary) value = expression("@*" + coefficients_[0].name, {value});
  switch (random_.weighted({4, 3, 2, 2})) {
    case 0: return expression("@", {value});
    case 1: return expression(lines_.percent(30) ? "linear" : "zero_gradient");
    case 2: return expression("gradient(@)", {value});
    default: return expression("mixed(@, @, @)", {expressions_.number(0.2, 2), expressions_.number(0.2, 2), value});
  }
}

void ModelBuilder::boundaries(Part& scene) {
  if (!has_walls()) return;
  for (const Rated& rated : rated_) {
    const std::vector<std::string> names = components(rated.quantity);
    for (std::size_t component = 0; component < names.size(); ++component) {
      Part sides{Part::Kind::list, "", {}};
      for (std::size_t axis = 0; axis < names_.axes.size(); ++axis) {
        if (names_.axes[axis].is_periodic) continue;
        const bool both = random_.percent(35);
        for (const char* end : {".low", ".high"}) {
          Part value = side(rated.quantity, axis);
          if (has_ties_ && ties_.percent(70)) value = expression(ties_.percent(60) ? "zero_gradient" : "0");
          sides.parts.push_back({Part::Kind::fixed, names_.axes[axis].name + (both ? "" : end) + " = @", {value}});
          if (both) break;
        }
      }
      add(scene, item("boundary " + names[component] + ": @", {sides}));
    }
  }
}

void ModelBuilder::values(Part& scene) {
  for (const std::string& name : params_) add(scene, item(name + " = @", {expressions_.number(0.2, 0.9)}));
  for (const std::string& name : controls_) {
    add(scene, item(fmt::format("{} = @*cos(5*t) every {}*{}", name, 1 + random_.below(2), step),
                    {expressions_.number(0.2, 0.9)}));
  }
  const auto scalar = [&](double mean) {
    const bool by_param = !params_.empty() && random_.percent(25), by_noise = random_.percent(10);
    Part value = expression(fmt::format("{:.2f} + 0.31*@", mean), {expressions_.formula()});
    if (by_param) value = expression("@ + 0.2*" + params_[0], {value});
    return by_noise ? expression("@ + 0.02*noise(3)", {value}) : value;
  };
  const auto set = [&](const std::string& head, const Quantity& q, const std::string& tail) {
    for (const std::string& name : components(q))
      add(scene, item(head + fmt::format(fmt::runtime(tail), name), {scalar(random_.uniform(0.7, 1.3))}));
  };
  for (const Quantity& q : coefficients_) set("", q, "{} = @");
  for (const Quantity& q : control_fields_) {
    const Part value = expression("(1 + t)*@", {expressions_.formula()});
    add(scene, item(fmt::format("{} = @ every {}*{}", q.name, 1 + random_.below(2), step), {value}));
  }
  for (const Rated& rated : rated_) {
    set("initial ", rated.quantity, "{} = @");
    if (rated.is_second) set("initial ", rated.quantity, "dt({}) = @");
  }
}

void ModelBuilder::events(Part& scene) {
  if (scheme_.remembers || !random_.percent(20)) return;
  const Rated& rated = any(rated_);
  const std::string name = any(components(rated.quantity));
  const std::vector<std::string> heads = {"after step", fmt::format("every 2*{}", step),
                                          fmt::format("at t = {}", step)};
  const std::string head = any(heads);
  switch (random_.below(3)) {
    case 0: return add(scene, item(head + ": " + name + " = max(" + name + ", @)", {expressions_.number(0.2, 0.9)}));
    case 1: return add(scene, item(head + ": " + name + " += 0.1*@", {expressions_.formula()}));
    default: return add(scene, item(head + ": " + name + " = " + name + "*@", {expressions_.uniform()}));
  }
}

void ModelBuilder::duration(Part& scene) {
  std::string line = fmt::format("time 0 .. @*{0}, step {0}", step);
  if (!scheme_.remembers && random_.percent(8)) line += ", courant 0.05, speed 2 + sin(t)";
  add(scene, item(line, {expression(fmt::format("{}", steps_))}));
  if (rated_.size() > 1 && !scheme_.remembers && !scheme_.along_flow && !scheme_.solves && random_.percent(15)) {
    add(scene, item(fmt::format("subcycle {} in {}", rated_.back().quantity.name, 2 + random_.below(2))));
  }
}

void ModelBuilder::describe_scene(Part& scene) {
  grids(scene);
  boundaries(scene);
  values(scene);
  events(scene);
  duration(scene);
  names_.reductions = false;
  if (random_.percent(30)) add(scene, item("observe o = mean((@)^2)", {expressions_.scalar(centre, 1)}));
}

std::string ModelBuilder::when() {
  switch (random_.weighted({5, 3, 2})) {
    case 0: return "";
    case 1: return " over time";
    default: return fmt::format(" at t = {}*{}", random_.below(steps_ + 1), step);
  }
}

/// It is 0 nowhere, and so is its derivative: a certificate has something to compare with.
Part ModelBuilder::distance() {
  return expression("mean((" + any(components(any(rated_).quantity)) + " - @)^2)", {expressions_.formula()});
}

Part ModelBuilder::loss() {
  const Rated& rated = any(rated_);
  const int axis = random_.below(rank());
  const Place place = place_of(rated.quantity, axis);
  const std::string name =
      rated.quantity.is_vector ? components(rated.quantity)[static_cast<std::size_t>(axis)] : rated.quantity.name;
  switch (random_.weighted({3, 3, 2})) {
    case 0: return expression("integral((" + name + " - @)^2)", {expressions_.scalar(place, 2)});
    case 1: return expression("sum(" + name + "*@)", {expressions_.scalar(place, 2)});
    default: return expression("mean(" + name + ")*@", {expressions_.number(0.2, 2)});
  }
}

void ModelBuilder::describe_task(Part& task) {
  std::vector<std::string> unknowns;
  for (const Rated& rated : rated_) {
    for (const std::string& name : components(rated.quantity)) unknowns.push_back("initial " + name);
    if (rated.is_second) unknowns.push_back("initial dt(" + rated.quantity.name + ")");
  }
  for (const std::string& name : params_) unknowns.push_back(name);
  for (const std::string& name : controls_) unknowns.push_back(name);
  for (const Quantity& q : coefficients_) {
    for (const std::string& name : components(q)) unknowns.push_back(name);
  }
  for (const Quantity& q : control_fields_) unknowns.push_back(q.name);
  const std::string sure = any(unknowns);
  for (const std::string& name : unknowns) {
    if (name == sure || random_.percent(50)) add(task, item("unknown " + name));
  }
  for (int count = 0, all = 1 + random_.weighted({4, 4, 2}); count < all; ++count) {
    const Part value = count == 0 ? distance() : loss();
    const std::string at = when();
    add(task, item("minimise @" + at, {value}));
  }
}

}  // namespace

Part random_model(std::uint64_t seed) { return ModelBuilder(seed).build(); }

}  // namespace dpde::testing
