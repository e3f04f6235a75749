// SPDX-License-Identifier: Apache-2.0
#include "driver/window_controls.h"

#include <algorithm>
#include <cmath>
#include <mutex>

namespace dpde::driver {

bool seeks_controls(const model::Problem& problem) {
  return problem.task && problem.task->training && std::ranges::any_of(problem.task->unknowns, [&](const model::Unknown& unknown) {
    const model::Coefficient* coefficient = problem.find_coefficient(unknown.name);
    return unknown.kind == model::Unknown::Kind::control || (unknown.kind == model::Unknown::Kind::coefficient && coefficient != nullptr && coefficient->is_control());
  });
}

WindowControls::WindowControls(const TrainingScene& scene, int iterations, const BatchOptions& options)
    : scene_(scene), iterations_(iterations), options_(options), batches_(scene, scene.steps(), std::numeric_limits<int>::max(), options) {}

std::vector<Window> WindowControls::windows() const {
  std::vector<Window> all;
  const int frames = scene_.steps() / scene_.trajectories.every;
  for (int run = 0; run < static_cast<int>(scene_.trajectories.runs.size()); ++run) {
    for (int frame = 0; frame + frames < scene_.trajectories.frame_count(); frame += frames) all.push_back({run, frame});
  }
  return all;
}

std::vector<std::string> WindowControls::states() const {
  std::vector<std::string> names;
  for (const model::State& state : scene_.compiled->problem->states) names.push_back(state.name);
  return names;
}

FoundControls WindowControls::find_one(Simulation& simulation, const Window& window) const {
  FoundControls found{window, {}, 0, {}};
  found.losses = simulation.optimise({}, iterations_).losses;
  for (double& loss : found.losses) loss *= batches_.scale();
  const std::vector<double> values = simulation.unknown_values();
  found.norm = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).norm();
  found.states.resize(states().size());
  simulation.reset();
  for (int k = 0; k < scene_.steps(); k += scene_.trajectories.every) {
    simulation.run_to(simulation.time() + scene_.trajectories.every * simulation.time_step());
    for (std::size_t s = 0; s < found.states.size(); ++s) {
      const std::vector<double> state = simulation.state(states()[s]);
      found.states[s].insert(found.states[s].end(), state.begin(), state.end());
    }
  }
  return found;
}

bool WindowControls::find(std::span<const Window> windows, const std::function<void(FoundControls)>& take) {
  const Eigen::VectorXd start = batches_.unknown_values();
  std::mutex one_at_a_time;
  const auto is_stopping = [&] { return options_.stop != nullptr && options_.stop->load(); };
  batches_.for_each(start, windows, {}, 0, [&](Simulation& simulation, std::size_t number) {
    if (is_stopping()) return;
    FoundControls found = find_one(simulation, windows[number]);
    if (is_stopping()) return;
    const std::scoped_lock lock(one_at_a_time);
    take(std::move(found));
  });
  return !is_stopping();
}

}  // namespace dpde::driver
