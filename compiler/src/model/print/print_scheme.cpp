// SPDX-License-Identifier: Apache-2.0
// Schemes as text.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/analyse/implicit_part.h"
#include "model/print/print_model.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

const char* limiter_text(Limiter limiter) {
  switch (limiter) {
    case Limiter::minmod: return "minmod";
    case Limiter::van_leer: return "van_leer";
    case Limiter::mc: return "mc";
  }
  unreachable("limiter");
}

std::string split_text(const Split& split) {
  std::vector<std::string> parts;
  for (const Split::Part& part : split.parts) {
    parts.emplace_back(name_of(part.terms));
    if (!part.states.empty()) parts.back() += fmt::format("({})", fmt::join(part.states, ", "));
  }
  return fmt::format("{}({})", split.kind == Split::Kind::lie ? "lie" : "strang", fmt::join(parts, ", "));
}

}  // namespace

std::string print_order(int order) { return order == spectral ? "spectral" : fmt::format("central({})", order); }

std::string print(const Transport& transport) {
  switch (transport.advect) {
    case Advection::central: return print_order(transport.order);
    case Advection::upwind: return fmt::format("upwind({})", transport.order);
    case Advection::weno: return fmt::format("weno({})", transport.order);
    case Advection::muscl: return fmt::format("muscl({})", limiter_text(transport.limiter));
    case Advection::semi_lagrangian: return transport.order == 3 ? "semi_lagrangian(cubic)" : "semi_lagrangian";
    case Advection::maccormack: return "maccormack";
    case Advection::maccormack_steady: return "maccormack(steady)";
  }
  unreachable("advection");
}

std::string print(TimeScheme time) { return time->name; }

std::string print(const SolveBy& by) {
  const std::string warning = by.warns ? ", warn" : "", name(name_of(by.method));
  if (warning.empty() && by.most_iterations == SolveBy{}.most_iterations)
    return by.tolerance == SolveBy{}.tolerance ? name : fmt::format("{}({})", name, by.tolerance);
  return fmt::format("{}({}, {}{})", name, by.tolerance, by.most_iterations, warning);
}

std::string print(const Scheme& s) {
  const std::string real = s.real == Precision::f64 ? "" : fmt::format("; real = {}", name_of(s.real));
  std::string others = s.dealias ? "; dealias = two_thirds" : "";
  if (s.is_split()) others += "; split = " + split_text(s.split);
  if (s.implicit != Implicit::linear) others += fmt::format("; implicit = {}", name_of(s.implicit));
  const std::string solve = print(s.solve);
  if (solve != print(SolveBy{})) others += "; solve = " + solve;
  if (s.solve.smoother != Smoother::automatic) others += fmt::format("; smoother = {}", name_of(s.solve.smoother));
  if (s.solve.preconditioner != Preconditioner::automatic)
    others += fmt::format("; preconditioner = {}", name_of(s.solve.preconditioner));
  if (s.guess != Guess::automatic) others += fmt::format("; guess = {}", name_of(s.guess));
  if (s.project != Project::automatic) others += fmt::format("; project = {}", name_of(s.project));
  std::string advect = print(s.transport);
  for (const auto& [state, own] : s.transports) advect += fmt::format("; advect {} = {}", state, print(own));
  return fmt::format("scheme {} {{ advect = {}; dx = {}; lap = {}{}; time = {}{} }}\n", s.name, advect,
                     print_order(s.derivative_order), print_order(s.laplacian_order), others, print(s.time), real);
}

}  // namespace dpde::model
