// SPDX-License-Identifier: Apache-2.0
// The scheme of the scene, and the lines it can have.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "model/from_ast/parts.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

struct Choice {
  std::string_view key, text;
  std::string_view others[2];  // other spellings
  void (*apply)(Scheme&);

  bool is_written(std::string_view written) const {
    return written == text || written == others[0] || written == others[1];
  }
};

template <Advection advect, int order>
void set_advect(Scheme& scheme) {
  scheme.transport = {advect, order};
}
template <Limiter limiter>
void set_muscl(Scheme& scheme) {
  set_advect<Advection::muscl, 2>(scheme);
  scheme.transport.limiter = limiter;
}
template <int order>
void set_derivative(Scheme& scheme) {
  scheme.derivative_order = order;
}
template <int order>
void set_laplacian(Scheme& scheme) {
  scheme.laplacian_order = order;
}

template <bool dealias>
void set_dealias(Scheme& scheme) {
  scheme.dealias = dealias;
}

template <SolveMethod method>
void set_solve(Scheme& scheme) {
  SolveBy by{method};
  by.smoother = scheme.solve.smoother;  // it has a key of its own
  by.preconditioner = scheme.solve.preconditioner;
  scheme.solve = by;
}

template <Smoother smoother>
void set_smoother(Scheme& scheme) {
  scheme.solve.smoother = smoother;
}

template <Preconditioner preconditioner>
void set_preconditioner(Scheme& scheme) {
  scheme.solve.preconditioner = preconditioner;
}

template <Guess guess>
void set_guess(Scheme& scheme) {
  scheme.guess = guess;
}

template <Project project>
void set_project(Scheme& scheme) {
  scheme.project = project;
}

template <Implicit implicit>
void set_implicit(Scheme& scheme) {
  scheme.implicit = implicit;
}

template <Precision real>
void set_real(Scheme& scheme) {
  scheme.real = real;
}

template <Precision real>
void set_networks(Scheme& scheme) {
  scheme.networks = real;
}

constexpr Choice choices[] = {
    {"advect", "central(2)", {"central2"}, set_advect<Advection::central, 2>},
    {"advect", "central(4)", {"central4"}, set_advect<Advection::central, 4>},
    {"advect", "central(6)", {"central6"}, set_advect<Advection::central, 6>},
    {"advect", "central(8)", {"central8"}, set_advect<Advection::central, 8>},
    {"advect", "spectral", {"spectral()"}, set_advect<Advection::central, spectral>},
    {"advect", "upwind(1)", {"upwind1", "upwind"}, set_advect<Advection::upwind, 1>},
    {"advect", "upwind(3)", {"upwind3"}, set_advect<Advection::upwind, 3>},
    {"advect", "upwind(5)", {"upwind5"}, set_advect<Advection::upwind, 5>},
    {"advect", "upwind(7)", {"upwind7"}, set_advect<Advection::upwind, 7>},
    {"advect", "weno(3)", {"weno3"}, set_advect<Advection::weno, 3>},
    {"advect", "weno(5)", {"weno5"}, set_advect<Advection::weno, 5>},
    {"advect", "muscl(minmod)", {"muscl_minmod"}, set_muscl<Limiter::minmod>},
    {"advect", "muscl(van_leer)", {"muscl_van_leer"}, set_muscl<Limiter::van_leer>},
    {"advect", "muscl(mc)", {"muscl_mc"}, set_muscl<Limiter::mc>},
    {"advect", "semi_lagrangian", {"semi_lagrangian()"}, set_advect<Advection::semi_lagrangian, 1>},
    {"advect",
     "semi_lagrangian(cubic)",
     {"semi_lagrangian_cubic", "semi_lagrangian(3)"},
     set_advect<Advection::semi_lagrangian, 3>},
    {"advect", "maccormack", {"maccormack()"}, set_advect<Advection::maccormack, 2>},
    {"advect", "maccormack(steady)", {"maccormack_steady"}, set_advect<Advection::maccormack_steady, 2>},
    {"dx", "central(2)", {"central2"}, set_derivative<2>},
    {"dx", "central(4)", {"central4"}, set_derivative<4>},
    {"dx", "central(6)", {"central6"}, set_derivative<6>},
    {"dx", "central(8)", {"central8"}, set_derivative<8>},
    {"dx", "spectral", {"spectral()"}, set_derivative<spectral>},
    {"lap", "central(2)", {"central2"}, set_laplacian<2>},
    {"lap", "central(4)", {"central4"}, set_laplacian<4>},
    {"lap", "central(6)", {"central6"}, set_laplacian<6>},
    {"lap", "central(8)", {"central8"}, set_laplacian<8>},
    {"lap", "spectral", {"spectral()"}, set_laplacian<spectral>},
    {"dealias", "none", {}, set_dealias<false>},
    {"dealias", "two_thirds", {"two_thirds()"}, set_dealias<true>},
    {"implicit", "linear", {}, set_implicit<Implicit::linear>},
    {"implicit", "all_but_advect", {}, set_implicit<Implicit::all_but_advect>},
    {"implicit", "all", {}, set_implicit<Implicit::all>},
    {"solve", "automatic", {}, set_solve<SolveMethod::automatic>},
    {"solve", "direct", {}, set_solve<SolveMethod::direct>},
    {"solve", "tridiagonal", {}, set_solve<SolveMethod::tridiagonal>},
    {"solve", "fourier", {}, set_solve<SolveMethod::fourier>},
    {"solve", "multigrid", {}, set_solve<SolveMethod::multigrid>},
    {"solve", "cg", {}, set_solve<SolveMethod::cg>},
    {"solve", "bicgstab", {}, set_solve<SolveMethod::bicgstab>},
    {"solve", "gmres", {}, set_solve<SolveMethod::gmres>},
    {"smoother", "automatic", {}, set_smoother<Smoother::automatic>},
    {"smoother", "red_black", {}, set_smoother<Smoother::red_black>},
    {"smoother", "jacobi", {}, set_smoother<Smoother::jacobi>},
    {"smoother", "chebyshev", {}, set_smoother<Smoother::chebyshev>},
    {"preconditioner", "automatic", {}, set_preconditioner<Preconditioner::automatic>},
    {"preconditioner", "multigrid", {}, set_preconditioner<Preconditioner::multigrid>},
    {"preconditioner", "none", {}, set_preconditioner<Preconditioner::none>},
    {"guess", "automatic", {}, set_guess<Guess::automatic>},
    {"guess", "last", {}, set_guess<Guess::last>},
    {"guess", "extrapolate", {}, set_guess<Guess::extrapolate>},
    {"guess", "none", {}, set_guess<Guess::none>},
    {"project", "automatic", {}, set_project<Project::automatic>},
    {"project", "stage", {}, set_project<Project::stage>},
    {"project", "step", {}, set_project<Project::step>},
    {"real", "f64", {}, set_real<Precision::f64>},
    {"real", "f32", {}, set_real<Precision::f32>},
    {"networks", "f32", {}, set_networks<Precision::f32>},
    {"networks", "f64", {}, set_networks<Precision::f64>},
};

const ast::Scheme* find_scheme(Elaboration& elaboration, const ast::Identifier& name) {
  const auto* scheme = find_declaration<ast::Scheme>(elaboration.file, name.name);
  if (!scheme) {
    elaboration.sink.report("unknown-block", name.range, {"scheme", name.name},
                            did_you_mean(name.name, names_of<ast::Scheme>(elaboration.file)));
  }
  return scheme;
}

/// All named schemes must exist; the first one counts.
const ast::Scheme* choose(Elaboration& elaboration) {
  std::vector<ast::Identifier> wishes;
  if (!elaboration.selection.scheme.empty()) wishes.push_back({elaboration.selection.scheme, {}});
  if (elaboration.blocks.task && elaboration.blocks.task->scheme && elaboration.selection.beside.empty())
    wishes.push_back(*elaboration.blocks.task->scheme);
  if (elaboration.blocks.scene->scheme) wishes.push_back(*elaboration.blocks.scene->scheme);
  if (wishes.empty()) {
    const std::vector<std::string> names = names_of<ast::Scheme>(elaboration.file);
    return names.empty() ? nullptr : find_declaration<ast::Scheme>(elaboration.file, names.front());
  }
  const ast::Scheme* chosen = nullptr;
  for (auto wish = wishes.rbegin(); wish != wishes.rend(); ++wish) chosen = find_scheme(elaboration, *wish);
  return chosen;
}

void bind_row(Elaboration& elaboration, const ast::ValueItem& row, Scheme& scheme) {
  const auto refusal = set_scheme_key(scheme, row.name.name, row.value);
  if (!refusal) return;
  const std::string list = fmt::format("choose one of: {}", fmt::join(refusal->choices, ", "));
  if (refusal->unknown_key) {
    elaboration.sink.report("unknown-scheme-key", row.name.range, {row.name.name},
                            did_you_mean(row.name.name, scheme_keys()));
  } else {
    elaboration.sink.report("bad-scheme-value", row.value.range(), {row.name.name, ast::print(row.value)}, list);
  }
}

}  // namespace

const std::vector<std::string>& scheme_keys() {
  static const std::vector<std::string> keys{
      "advect",         "dx",    "lap",     "dealias", "implicit", "solve",   "smoother",
      "preconditioner", "guess", "project", "time",    "real",     "networks"};
  return keys;
}

/// cg(1e-12), cg(1e-12, 500), cg(1e-12, 500, warn): tolerance, maximum number of iterations, and whether missing the
/// tolerance is only a warning.
static std::optional<SolveBy> solve_by(const ast::Expr& value) {
  const auto* call = std::get_if<ast::Call>(&value->kind);
  const std::optional<SolveMethod> method = call ? find_solve_method(call->callee) : std::nullopt;
  if (!method || call->arguments.empty() || call->arguments.size() > 3) return std::nullopt;
  SolveBy by{*method};
  const auto number = [&](std::size_t i) {
    const auto* found = std::get_if<ast::Number>(&call->arguments[i].value->kind);
    return found && call->arguments[i].name.empty() ? found->value : 0;
  };
  by.tolerance = number(0);
  if (call->arguments.size() > 1) {
    const double most = number(1);
    if (!(most >= 1 && most <= 1e9 && most == std::floor(most))) return std::nullopt;
    by.most_iterations = static_cast<int>(most);
  }
  if (call->arguments.size() > 2) {
    const auto* word = std::get_if<ast::Name>(&call->arguments[2].value->kind);
    if (!word || word->name != "warn") return std::nullopt;
    by.warns = true;
  }
  return by.tolerance > 0 && by.tolerance < 1 ? std::optional(by) : std::nullopt;
}

std::optional<SchemeRefusal> set_scheme_key(Scheme& scheme, const std::string& key, const ast::Expr& value) {
  if (std::holds_alternative<ast::Error>(value->kind)) return std::nullopt;
  if (const std::optional<SolveBy> by = key == "solve" ? solve_by(value) : std::nullopt) {
    const SolveBy before = scheme.solve;
    scheme.solve = *by;
    scheme.solve.smoother = before.smoother;
    scheme.solve.preconditioner = before.preconditioner;
    return std::nullopt;
  }
  const std::string text = ast::print(value);
  SchemeRefusal refusal;
  for (const TimeMethod& method : key == "time" ? time_methods() : std::span<const TimeMethod>()) {
    if (text == method.name || text == fmt::format("{}()", method.name)) {
      scheme.time = &method;
      return std::nullopt;
    }
    refusal.choices.emplace_back(method.name);
  }
  for (const Choice& choice : choices) {
    if (choice.key != key) continue;
    if (choice.is_written(text)) {
      choice.apply(scheme);
      return std::nullopt;
    }
    refusal.choices.emplace_back(choice.text);
  }
  refusal.unknown_key = refusal.choices.empty();
  if (key == "solve") refusal.choices.emplace_back("one of them as in cg(1e-12, 200, warn)");
  return refusal;
}

void bind_scheme(Elaboration& elaboration) {
  const ast::Scheme* chosen = choose(elaboration);
  if (chosen) {
    elaboration.problem.scheme.name = chosen->name.name;
    std::map<std::string, SourceRange> seen;
    for (const auto& [row, range] : items_of<ast::ValueItem>(chosen->items)) {
      if (row.of || row.name.name == split_key) continue;
      const auto [first, is_new] = seen.emplace(row.name.name, row.name.range);
      if (!is_new) report_duplicate(elaboration, row.name.name, row.name.range, first->second);
      if (is_new) bind_row(elaboration, row, elaboration.problem.scheme);
    }
  }
  apply_scheme_settings(elaboration);
}

/// Lines for single fields, which are known at this point.
void bind_transports(Elaboration& elaboration) {
  const ast::Scheme* chosen = find_declaration<ast::Scheme>(elaboration.file, elaboration.problem.scheme.name);
  if (!chosen) return;
  std::map<std::string, SourceRange> seen;
  for (const auto& [row, range] : items_of<ast::ValueItem>(chosen->items)) {
    if (!row.of) continue;
    if (row.name.name != "advect") {
      elaboration.sink.report("not-allowed-here", row.of->range, {"a field", fmt::format("the row {}", row.name.name)},
                              fmt::format("leave {} out; only advect is chosen field by field", row.of->name));
      continue;
    }
    const std::vector<State*> states = find_states(elaboration, *row.of, "an advect of its own");
    if (states.empty() || !is_first(elaboration, "the advect", *row.of, states, seen)) continue;
    Scheme own;
    bind_row(elaboration, row, own);
    for (const State* state : states) elaboration.problem.scheme.transports[state->name] = own.transport;
  }
}

}  // namespace dpde::model
