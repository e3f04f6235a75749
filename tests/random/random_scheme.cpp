// SPDX-License-Identifier: Apache-2.0
#include "random/random_scheme.h"

#include <fmt/format.h>

#include <array>

namespace dpde::testing {

namespace {

const std::vector<std::string> ways = {
    "central(2)",    "central(4)",        "central(6)", "central(8)",      "upwind(1)",
    "upwind(3)",     "upwind(5)",         "upwind(7)",  "weno(3)",         "weno(5)",
    "muscl(minmod)", "muscl(van_leer)",   "muscl(mc)",  "semi_lagrangian", "semi_lagrangian(cubic)",
    "maccormack",    "maccormack(steady)"};

std::string random_split(SplitMix& parts) {
  constexpr std::array<const char*, 6> orders = {"advect, sources, diffusion", "advect, diffusion, sources",
                                                 "sources, advect, diffusion", "sources, diffusion, advect",
                                                 "diffusion, advect, sources", "diffusion, sources, advect"};
  return fmt::format("{}({})", parts.percent(50) ? "lie" : "strang", orders[static_cast<std::size_t>(parts.below(6))]);
}

}  // namespace

Scheme random_scheme(SplitMix& random, SplitMix& parts) {
  Scheme scheme;
  const std::vector<std::string> times = {"euler",   "rk2", "ab2",        "ab3",    "leapfrog", "verlet",
                                          "ssp_rk3", "rk4", "imex_euler", "ars222", "ars443"};
  scheme.time = times[static_cast<std::size_t>(random.weighted({5, 5, 2, 2, 2, 3, 2, 3, 1, 2, 1}))];
  SplitMix waves = parts;  // draws that others do not see: models of seeds that were looked at stay as they are
  waves.next();
  if (waves.percent(8)) scheme.time = waves.percent(50) ? "etdrk2" : "etdrk4";
  scheme.solves = scheme.time[0] == 'i' || scheme.time.starts_with("ars");
  scheme.second_order = scheme.time == "verlet" || (scheme.time == "leapfrog" && random.percent(50));
  scheme.remembers = scheme.time == "ab2" || scheme.time == "ab3" || scheme.time == "leapfrog";
  if (scheme.time != "verlet" && !scheme.remembers && parts.percent(25)) scheme.split = random_split(parts);
  const bool may_flow = scheme.time != "verlet" && !scheme.remembers && (!scheme.solves || !scheme.split.empty());
  const int flow = may_flow ? 2 : 0;
  scheme.advect = ways[static_cast<std::size_t>(
      random.weighted({4, 3, 1, 1, 3, 2, 1, 1, 1, 1, 1, 1, 1, may_flow ? 3 : 0, flow, flow, may_flow ? 1 : 0}))];
  scheme.along_flow = scheme.advect[0] == 's' || scheme.advect.starts_with("maccormack");
  return scheme;
}

std::vector<std::string> scheme_rows(const Scheme& scheme, const std::vector<std::string>& fields, SplitMix& random,
                                     SplitMix& parts) {
  std::vector<std::string> rows{"time = " + scheme.time, "advect = " + scheme.advect};
  const auto order = [&] { return fmt::format("central({})", 2 + 2 * random.weighted({5, 3, 1, 1})); };
  if (random.percent(60)) rows.push_back("dx = " + order());
  if (random.percent(60)) rows.push_back("lap = " + order());
  if (random.percent(6)) rows.push_back("real = f32");
  for (const std::string& field : fields) {
    if (!parts.percent(12)) continue;
    rows.push_back("advect " + field + " = " +
                   ways[static_cast<std::size_t>(parts.below(static_cast<int>(ways.size())))]);
  }
  if (!scheme.split.empty()) rows.push_back("split = " + scheme.split);
  return rows;
}

}  // namespace dpde::testing
