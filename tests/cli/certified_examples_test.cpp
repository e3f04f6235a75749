// SPDX-License-Identifier: Apache-2.0
// `dpde verify` on every scene and task of every file of dsl-examples, one test per file. The files are found by a
// search, not listed.
#include <algorithm>
#include <map>
#include <set>

#include "command_support.h"
#include "support/examples_by_day.h"

namespace dpde::testing {
namespace {

/// Settings for speed; all others run unchanged.
const std::map<std::string, std::string> smaller = {
    {"air free", "--set cells=8 --set end=28800"},
    {"brusselator tanks", "--set cells=8"},
    {"burgers_2d recover", "--set cells=16"},
    {"burgers_2d sweep", "--set cells=128"},
    {"convection heat_by_rayleigh", "--set cells=8 --set step=1/512"},
    {"convection heated_cavity", "--set cells=8 --set step=1/512"},
    {"convection onset", "--set end=0.125"},
    {"convection rolls", "--set cells=8 --set step=1/4096 --set end=1/128"},
    {"corrector by_found_numbers", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector coarse", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector corrected", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector doubled", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector fine_plasma", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector numbered", "--set cells=8 --set end=0.1 --set time=euler"},
    {"corrector statistics", "--set cells=8"},
    {"corrector statistics_by_numbers", "--set cells=8"},
    {"drag drag_alone", "--set cells.x=11 --set cells.y=4 --set step=0.05"},
    {"drag less_pull", "--set cells.x=11 --set cells.y=4 --set step=0.05"},
    {"drag less_pull_by_adam", "--set cells.x=11 --set cells.y=4 --set step=0.05"},
    {"drag pulled", "--set cells.x=11 --set cells.y=4 --set step=0.05"},
    {"eddies by_plain_numbers", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies climate", "--set cells=8"},
    {"eddies climate_by_numbers", "--set cells=8"},
    {"eddies closed", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies doubled", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies fine", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies numbered", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies plain", "--set cells=8 --set end=0.1 --set time=euler"},
    {"eddies states", "--set cells=8"},
    {"fitzhugh_nagumo patient", "--set cells=32"},
    {"fitzhugh_nagumo scar", "--set cells=32"},
    {"flow cavity", "--set cells=8 --set end=0.5"},
    {"flow cylinder", "--set cells.x=44 --set cells.y=8 --set end=0.5"},
    {"flow decay_3d", "--set cells=8 --set end=1"},
    {"flow less_drag", "--set cells.x=44 --set cells.y=8 --set end=0.5"},
    {"flow taylor_green_3d", "--set cells=8 --set end=1"},
    {"flow wake", "--set cells.x=44 --set cells.y=8 --set end=0.1"},
    {"first_guess back", "--set cells=16"},
    {"first_guess back_by_point", "--set cells=16"},
    {"first_guess iterate", "--set cells=16"},
    {"first_guess learn_to_point", "--set cells=16"},
    {"first_guess residual", "--set cells=16"},
    {"first_guess supervised", "--set cells=16"},
    {"first_guess box", "--set cells=16 --set end=1/32"},
    {"first_guess flexible_box", "--set cells=16 --set end=1/32"},
    {"first_guess truth", "--set cells=16 --set end=1/32"},
    {"forced_burgers cubic_64", "--set cells=32 --set end=5"},
    {"forced_burgers fine", "--set cells=32 --set end=5"},
    {"forced_burgers hybrid", "--set cells=32 --set end=5"},
    {"forced_burgers plain_64", "--set end=5"},
    {"filtered by_bump", "--set cells=16 --set end=1200 --set step=600 --set time=euler"},
    {"filtered filtered_rotation", "--set cells=8 --set end=1200 --set step=600 --set time=euler"},
    {"filtered galewsky", "--set cells=8 --set end=1200 --set step=600 --set time=euler"},
    {"filtered wholly_filtered_rotation", "--set cells=8 --set end=1200 --set step=600 --set time=euler"},
    {"forced_burgers plain_cubic", "--set cells=32 --set end=5"},
    {"forced_burgers plain_third", "--set cells=32 --set end=5"},
    {"forced_burgers third_64", "--set cells=32 --set end=5"},
    {"free_rolls first_growth", "--set cells=16 --set end=0.01"},
    {"gray_scott spots", "--set cells=64 --set end=100"},
    {"free_rolls free_rolls", "--set cells=16 --set end=0.01"},
    {"hybrid fine", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid plain", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid plain_third", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid doubled", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid doubled_third", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid hybrid", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid hybrid_third", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid hybrid_small", "--set cells.x=8 --set cells.y=16 --set end=2"},
    {"hybrid sol4", "--set cells.x=8 --set cells.y=16"},
    {"hybrid sol4_third", "--set cells.x=8 --set cells.y=16"},
    {"hybrid non", "--set cells.x=8 --set cells.y=16"},
    {"hybrid small_2", "--set cells.x=8 --set cells.y=16"},
    {"hybrid small_4", "--set cells.x=8 --set cells.y=16"},
    {"hybrid small_8", "--set cells.x=8 --set cells.y=16"},
    {"hybrid small_16", "--set cells.x=8 --set cells.y=16"},
    {"hybrid small_32", "--set cells.x=8 --set cells.y=16"},
    {"ground seasons", "--set cells=8 --set end=28800"},
    {"heat block", "--set cells=24"},
    {"hold by_hand", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold constant", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold free", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold least_effort", "--set cells=8"},
    {"hold learned", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold whole_run", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold_network coarse_free", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold_network coarse_plasma", "--set cells=8 --set end=0.1 --set time=euler"},
    {"hold_network least_effort_by_network", "--set cells=8 --set end=0.1 --set time=euler"},
    {"jet at_once", "--set cells.x=8 --set cells.y=32"},
    {"jet find_drag", "--set cells.x=8 --set cells.y=32"},
    {"jet guess", "--set cells=8 --set end=1800"},
    {"jet truth", "--set cells=8 --set end=1800"},
    {"jet window", "--set cells.x=8 --set cells.y=32"},
    {"kolmogorov correct", "--set cells=16"},
    {"kolmogorov corrected", "--set cells=16 --set end=1/24"},
    {"kolmogorov curled", "--set cells=16"},
    {"kolmogorov curled_rotational", "--set cells=16"},
    {"kolmogorov interpolate_by_network", "--set cells=16"},
    {"kolmogorov interpolated", "--set cells=16 --set end=1/24"},
    {"kolmogorov plain", "--set cells=16 --set end=1/24"},
    {"kolmogorov plain_128", "--set cells=16 --set end=1/48"},
    {"kolmogorov rotational", "--set cells=16 --set end=1/24"},
    {"kolmogorov rotational_128", "--set cells=16 --set end=1/48"},
    {"kolmogorov rotational_corrected", "--set cells=16 --set end=1/24"},
    {"kolmogorov spectral_128", "--set cells=16 --set end=1/48"},
    {"kolmogorov spectral_64", "--set cells=16 --set end=1/24"},
    {"kolmogorov truth", "--set cells=16 --set end=1/96"},
    {"kolmogorov without_divergence", "--set cells=16 --set end=1/24"},
    {"learned_flux fine", "--set cells=128 --set end=5"},
    {"lorenz butterfly", "--set end=2"},
    {"plasma faster_by_eta",
     "--set cells.x=12 --set cells.y=6 --set end=10 --set time=euler --set dx=central2 --set lap=central2 --set "
     "kick=0.01"},
    {"plasma find_c", "--set cells=8 --set end=0.1 --set time=euler"},
    {"plasma start", "--set cells=8 --set end=0.1 --set time=euler"},
    {"plasma tearing",
     "--set cells.x=12 --set cells.y=6 --set end=1 --set time=euler --set dx=central2 --set lap=central2"},
    {"plasma turbulence", "--set cells=8 --set end=0.1 --set time=euler"},
    {"plasma whirls", "--set cells=16 --set end=0.1"},
    {"plasma zonal", "--set cells=8 --set end=0.1 --set time=euler"},
    {"shallow_water bank", "--set cells=16"},
    {"shallow_water basin", "--set cells=16"},
    {"species spirals", "--set cells=16 --set end=10"},
    {"species who", "--set cells=8"},
    {"sphere bell", "--set cells=8 --set end=0.1*pi --set step=0.02*pi"},
    {"sphere footprint", "--set cells=8 --set end=1200 --set step=300 --set time=euler"},
    {"sphere harmonic", "--set cells=8 --set end=1/128"},
    {"sphere height", "--set cells=16 --set end=3600 --set step=600 --set time=euler"},
    {"sphere mountain", "--set cells=8 --set end=1200 --set step=300 --set time=euler"},
    {"sphere recover", "--set cells=8 --set end=21600 --set step=3600 --set time=euler"},
    {"sphere rotation", "--set cells=8 --set end=2400 --set time=euler"},
    {"sphere wave", "--set cells=8 --set end=1200 --set step=300 --set time=euler"},
    {"helmholtz_hodge projected", "--set cells=16"},
    {"steered cases", "--set cells=8"},
    {"steered direct", "--set cells=8"},
    {"steered each", "--set cells=8"},
    {"steered guided", "--set cells=8"},
    {"steered judged", "--set cells=8"},
    {"steered learn", "--set cells=8"},
    {"steered waiting", "--set cells=8"},
    {"stations eddies_there", "--set cells=8 --set end=1800 --set time=euler"},
    {"stations estimate", "--set cells=8 --set end=900 --set time=euler"},
    {"stations guess", "--set cells=8 --set end=1200 --set time=euler"},
    {"stations scaled", "--set cells=8"},
    {"stations stations_alone", "--set cells=8 --set step=3600"},
    {"stations truth", "--set cells=8 --set end=1200 --set time=euler"},
    {"stations window", "--set cells=8 --set step=3600"},
    {"stiff_brusselator sensitivities", "--set cells=24 --set step=1/10"},
    // an arbitrary state may be too far from the slow manifold for a long step of the stiff equation
    {"stiff_brusselator tube", "--set cells=16 --set eps=0.01 --set step=1/1000 --set end=0.02"},
    {"turned by_gains", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned direct", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned harmonic", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned learn", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned linear", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned prescribed", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned steered", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned wake", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"turned with_gains", "--set cells.x=20 --set cells.y=12 --set step=1/8 --set end=2"},
    {"vortices_3d vortices", "--set cells=4 --set end=0.3"},
    {"vorticity layers", "--set cells=16 --set end=0.5"},
    {"vorticity merger", "--set cells=32 --set end=1"},
    {"layers find_shear", "--set time=euler --set end=0.04"},
    {"layers heat_by_shear", "--set time=euler --set cells=8 --set end=0.04"},
    {"layers growth", "--set time=euler --set end=0.04"},
    {"layers ocean", "--set time=euler --set end=400000"},
    {"layers weather", "--set time=euler --set cells=8 --set end=0.04"},
    {"water ridge", "--set cells=8 --set end=28800"},
    {"waves alfven", "--set cells=8 --set end=pi/16"},
    {"waves growing", "--set cells=8 --set end=0.1"},
    {"waves rate", "--set cells=8 --set end=0.1"},
    {"observed by_newton", "--set cells=8"},
    {"observed exact", "--set cells=8"},
    {"observed observed", "--set cells=8"},
    {"observed rubbed_and_washed", "--set cells=8"},
    {"year find_wash", "--set cells=8 --set step=14400"},
    {"year rain_by_swell", "--set cells=8 --set step=14400"},
    {"year ten_days", "--set cells=6 --set end=14400 --set time=euler"},
    {"year year", "--set cells=6 --set end=14400 --set time=euler"},
    {"wake fine", "--set cells.x=13 --set cells.y=26 --set end=3"},
};

/// These need files written by other commands (trained weights) or published elsewhere.
const std::map<std::string, std::string> without_their_files = {
    {"back_by_point", "point/point.safetensors"},
    {"by_climate", "climate/stress.safetensors"},
    {"by_point", "point/point.safetensors"},
    {"by_states", "states/stress.safetensors"},
    {"by_statistics", "statistics/stress.safetensors"},
    {"by_iterate", "first.safetensors"},
    {"by_residual", "first.safetensors"},
    {"by_solution", "first.safetensors"},
    {"beforehand_test", "small.safetensors"},
    {"by_network", "policy.safetensors"},
    {"curves", "from_equation.safetensors"},
    {"judge", "gains.safetensors"},
    {"look", "law.safetensors"},
    {"picture", "potential.safetensors"},
    {"published", "pbdl_burgers_t16.npy"},
    {"turned_by_network", "policy.safetensors"},
    {"unseen", "controller.safetensors"},
};

/// Examples that take five seconds or more.
const std::set<std::string> at_night = {"corrector",    "eddies",  "filtered",   "first_guess", "hold",
                                        "hold_network", "hybrid",  "kolmogorov", "observed",    "sphere",
                                        "stations",     "steered", "turned",     "year"};

class AllTasksAndScenesAreCertified : public Command, public ::testing::WithParamInterface<fs::path> {
 protected:
  void certify(const std::string& target) const {
    const std::string stem = GetParam().stem().string();
    const auto settings = smaller.find(stem + " " + target);
    const Outcome outcome = dpde("verify '" + GetParam().string() + "' " + target + " --json --threads 1 " +
                                 (settings == smaller.end() ? "" : settings->second));
    const auto missing = without_their_files.find(target);
    if (missing != without_their_files.end() && outcome.status == 2) {
      EXPECT_NE(outcome.err.find("cannot read"), std::string::npos) << outcome.err;
      EXPECT_NE(outcome.err.find(missing->second), std::string::npos) << outcome.err;
      return;
    }
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json result = outcome.json();
    EXPECT_TRUE(result["passed"].get<bool>());
    EXPECT_LE(result["dot_product"]["max_relative_error"].get<double>(), 1e-11);
    EXPECT_GT(result["dot_product"]["cases"].get<int>(), 3);
    const Json& taylor = result["taylor"];
    const bool has_slope = taylor["slope"].is_number() && std::abs(taylor["slope"].get<double>() - 2) <= 0.05;
    const bool is_linear = taylor["slope"].is_null() && taylor["quotient_error"].is_null();  // remainders are rounding
    EXPECT_TRUE(has_slope || is_linear ||
                (taylor["quotient_error"].is_number() && taylor["quotient_error"].get<double>() <= 1e-5))
        << taylor;
  }
};

TEST_P(AllTasksAndScenesAreCertified, Of) {
  const std::vector<fs::path> files = example_files();
  const auto number = static_cast<std::size_t>(std::ranges::find(files, GetParam()) - files.begin());
  if ((at_night.contains(GetParam().stem().string()) && !is_thorough()) || !is_tried(number, 3))
    GTEST_SKIP() << "at night";
  const std::vector<std::string> targets = targets_by_day(content(GetParam()));
  ASSERT_FALSE(targets.empty());
  for (const std::string& target : targets) {
    SCOPED_TRACE(target);
    certify(target);
  }
}

INSTANTIATE_TEST_SUITE_P(Examples, AllTasksAndScenesAreCertified, ::testing::ValuesIn(example_files()),
                         [](const auto& info) { return info.param.stem().string(); });

/// The lists above contain no example that no longer exists.
TEST(Examples, WhatIsMadeSmallerOrLacksAFileIsThere) {
  std::map<std::string, int> seen;
  for (const fs::path& file : example_files()) {
    for (const std::string& target : targets_of(content(file)))
      ++seen[target], ++seen[file.stem().string() + " " + target];
  }
  for (const auto& [target, settings] : smaller) EXPECT_EQ(seen[target], 1) << target;
  for (const auto& [target, file] : without_their_files) EXPECT_EQ(seen[target], 1) << target;
  EXPECT_GE(example_files().size(), 23u);
}

}  // namespace
}  // namespace dpde::testing
