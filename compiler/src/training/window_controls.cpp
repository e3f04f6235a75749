// SPDX-License-Identifier: Apache-2.0
#include "training/window_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "model/print/print_model.h"
#include "stencil/text/print_stencil.h"

namespace dpde::training {

bool seeks_controls(const model::Problem& problem) {
  return problem.task && problem.task->training &&
         std::ranges::any_of(problem.task->unknowns, [&](const model::Unknown& unknown) {
           const model::Coefficient* coefficient = problem.find_coefficient(unknown.name);
           return unknown.kind == model::Unknown::Kind::control ||
                  (unknown.kind == model::Unknown::Kind::coefficient && coefficient != nullptr &&
                   coefficient->is_control());
         });
}

WindowControls::WindowControls(const TrainingScene& scene, int iterations, const BatchOptions& options)
    : scene_(scene),
      iterations_(iterations),
      options_(options),
      batches_(scene, scene.steps(), std::numeric_limits<int>::max(), options) {}

std::vector<Window> WindowControls::windows() const {
  std::vector<Window> all;
  for (int run = 0; run < static_cast<int>(scene_.trajectories.runs.size()); ++run) {
    for (int frame = 0; frame + frames() < scene_.trajectories.frame_count(); frame += frames())
      all.push_back({run, frame});
  }
  return all;
}

int WindowControls::frames_left_over() const { return (scene_.trajectories.frame_count() - 1) % frames(); }

std::uint64_t WindowControls::key() {
  const driver::Compiled& compiled = *scene_.compiled;
  const model::Optimiser& optimiser = *scene_.task().optimiser;
  std::string text =
      fmt::format("{}\n{}\n{} {} {} {}\n", print(compiled.stencil), model::print(compiled.problem->scheme),
                  scene_.task().name, scene_.steps(), scene_.trajectories.hash(), scene_.given_hash);
  text += fmt::format("{} {} {} {} {}\n", static_cast<int>(optimiser.kind), optimiser.rate, optimiser.gauss_newton,
                      iterations_ > 0 ? iterations_ : optimiser.iterations,
                      compiled.options.backend ? static_cast<int>(*compiled.options.backend) : -1);
  for (const model::Parameter& param : compiled.problem->params)
    text += fmt::format("{} = {}\n", param.name, param.value);
  text += fmt::format("{} {} {} {}\n", compiled.problem->step, compiled.problem->t_begin, scene_.trajectories.every,
                      frames());
  for (const model::Coefficient& coefficient : compiled.problem->coefficients)
    text += fmt::format("{} {}\n", coefficient.name, coefficient.every);
  for (const UnknownPart& part : batches_.parts()) text += fmt::format("{} {} {}\n", part.name, part.low, part.high);
  const Eigen::VectorXd start = batches_.unknown_values();
  return hash_bytes(start.data(), static_cast<std::size_t>(start.size()) * sizeof(double),
                    hash_bytes(text.data(), text.size()));
}

std::vector<std::string> WindowControls::states() const {
  std::vector<std::string> names;
  for (const model::State& state : scene_.compiled->problem->states) names.push_back(state.name);
  return names;
}

/// Runs with the present controls of the simulation. @throws Error naming the step at which a state is no longer
/// finite.
void WindowControls::run(Simulation& simulation, FoundControls& found) const {
  found.states.resize(states().size());
  simulation.reset();
  for (int k = 1; k <= scene_.steps(); ++k) {
    simulation.run_to(simulation.time() + simulation.time_step());
    if (k % scene_.trajectories.every != 0) continue;
    for (std::size_t s = 0; s < found.states.size(); ++s) {
      const std::vector<double> state = simulation.state(states()[s]);
      found.states[s].insert(found.states[s].end(), state.begin(), state.end());
    }
  }
}

FoundControls WindowControls::find_one(Simulation& simulation, const Window& window) const {
  FoundControls found{window, {}, 0, {}, {}};
  try {
    const Optimised result = simulation.optimise({}, iterations_);
    found.losses = result.losses;
    const std::vector<double> values = simulation.unknown_values();
    found.norm = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).norm();
    run(simulation, found);
    if (result.reason == StopReason::not_finite)
      found.why = fmt::format("the loss or its gradient is not finite at iteration {}", result.iterations);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::run) throw;
    found.why = error.what();
  }
  if (!found.why.empty()) found.states.clear();
  return found;
}

bool WindowControls::find(std::span<const Window> windows, const std::function<bool(FoundControls)>& take) {
  const Eigen::VectorXd start = batches_.unknown_values();
  std::mutex one_at_a_time;
  std::atomic<bool> is_enough = false;
  const auto is_stopping = [&] { return is_enough.load() || (options_.stop != nullptr && options_.stop->load()); };
  batches_.for_each(start, windows, {}, 0, [&](Simulation& simulation, std::size_t number) {
    if (is_stopping()) return;
    FoundControls found = find_one(simulation, windows[number]);
    if (is_stopping()) return;
    const std::scoped_lock lock(one_at_a_time);
    if (!take(std::move(found))) is_enough = true;
  });
  return !is_stopping();
}

}  // namespace dpde::training
