// SPDX-License-Identifier: Apache-2.0
#include "training/data/window_batches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "dpde/runtime/random.h"
#include "driver/memory/storage.h"

namespace dpde::training {

namespace {

Values values_in(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

/// Name of the datum's frames in the scene's trajectories.
const std::string& name_of(const TrainingScene& scene, const dpde_datum& datum) {
  return scene.trajectories.name_of(*std::ranges::find(scene.task().data, datum.name, &model::Datum::name));
}

}  // namespace

/// Uses the scene's table with another number of steps; all other entries hold for any length.
WindowBatches::WindowBatches(const TrainingScene& scene, int steps, int largest_batch, const BatchOptions& options)
    : from_(scene), steps_(steps), scene_(scene.table->scene()), is_timed_(options.is_timed) {
  const int every = scene.trajectories.looks;
  for (int k = every; k <= steps; k += every) at_.push_back(k);
  const auto count = static_cast<std::int32_t>(at_.size());
  losses_.assign(scene_.losses, scene_.losses + scene_.loss_count);
  for (std::size_t i = 0; i < losses_.size(); ++i) {
    const bool is_last = scene.task().losses[i].when.is_last;
    if (losses_[i].of_averages != 0) continue;
    losses_[i].at = is_last ? dpde_instants{1, &steps_} : dpde_instants{count, at_.data()};
    if (!is_last) losses_[i].weight = static_cast<double>(scene.steps()) / count;  // scaled to the task's states
  }
  data_.assign(scene_.data, scene_.data + scene_.datum_count);
  for (dpde_datum& datum : data_) {
    const bool is_one = count == 1 || scene.trajectories.is_goal(name_of(scene, datum));
    datum.at = is_one ? dpde_instants{0, nullptr} : dpde_instants{count, at_.data()};
  }
  scene_.steps = steps;
  scene_.losses = losses_.data();
  scene_.data = data_.data();
  const int threads = std::clamp(options.threads, 1, std::max(largest_batch, 1));
  team_ = Team(threads);
  SimulationOptions each;
  each.checkpoint_bytes = driver::budget_of_states({threads, options.checkpoint_bytes, ""}) / threads;
  if (!options.stores_states) each.slots = 1;
  each.cut = options.cut;
  each.stop = options.stop;
  busy_.resize(static_cast<std::size_t>(threads));
  for (int t = 0; t < threads; ++t) {
    seconds_.emplace_back();
    each.seconds = is_timed_ ? &seconds_.back() : nullptr;
    simulations_.emplace_back(scene_, each, scene.table);
    scene.give(simulations_.back());
  }
}

WindowBatches::~WindowBatches() = default;

Eigen::VectorXd WindowBatches::unknown_values() {
  const std::vector<double> values = simulations_.front().unknown_values();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<UnknownPart> parts_of(const dpde_scene& scene, Simulation& simulation) {
  std::vector<UnknownPart> all;
  Eigen::Index offset = 0;
  for (const dpde_unknown& unknown : std::span(scene.unknowns, static_cast<std::size_t>(scene.unknown_count))) {
    const auto size = static_cast<Eigen::Index>(simulation.value_of(unknown.name).size());
    all.push_back({unknown.name, unknown.kind, unknown.low, unknown.high, offset, size});
    offset += size;
  }
  return all;
}

std::vector<UnknownPart> WindowBatches::parts() { return parts_of(scene_, simulations_.front()); }

void WindowBatches::begin(Simulation& simulation, const Eigen::VectorXd& x, const Window& window,
                          const StartNoise& noise, std::uint64_t number) {
  const files::Trajectories& trajectories = from_.trajectories;
  from_.begin(simulation, trajectories, window);
  simulation.set_unknowns(values_in(x));
  for (std::size_t s = 0; s < noise.deviations.size(); ++s) {
    const std::span<const double> frame = trajectories.frames(window.run, trajectories.states[s], window.frame);
    std::vector<double> start(frame.begin(), frame.end());
    for (std::size_t i = 0; i < start.size(); ++i)
      start[i] += noise.deviations[s] * normal(noise.seed, i * noise.deviations.size() + s, noise.stream + number);
    simulation.set_initial(trajectories.states[s], start);
  }
  for (const dpde_datum& datum : data_)
    simulation.set_field(datum.name, trajectories.frames(window.run, name_of(from_, datum), window.frame + 1,
                                                         static_cast<int>(at_.size())));
}

void WindowBatches::for_each(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise,
                             std::size_t first, const Work& work) {
  const Stopwatch whole(is_timed_ ? &region_ : nullptr);
  team_.run(static_cast<std::int64_t>(windows.size()), [&](std::int64_t i, int t) {
    const auto number = static_cast<std::size_t>(i), thread = static_cast<std::size_t>(t);
    const Stopwatch busy(is_timed_ ? &busy_[thread] : nullptr);
    begin(simulations_[thread], x, windows[number], noise, first + number);
    work(simulations_[thread], number);
  });
}

namespace {

/// NaN for a run that blows up or has no solution; the training reports the sample.
double finite_or_nan(const std::function<double()>& loss) {
  try {
    return loss();
  } catch (const NotFinite&) {
    return std::numeric_limits<double>::quiet_NaN();
  } catch (const NoSolution&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace

/// Processes many samples in chunks, to limit the memory of their vectors.
WindowBatches::Result WindowBatches::over(const Eigen::VectorXd& x, std::span<const Window> windows,
                                          const StartNoise& noise, const Question& question, Eigen::VectorXd* sum) {
  constexpr std::size_t at_once = 64;
  const std::size_t most = std::min(windows.size(), at_once);
  std::vector<double> values(most);
  Result result;
  if (sum != nullptr) sum->setZero(x.size());
  vectors_.resize(std::max(vectors_.size(), most));
  for (std::size_t first = 0; first < windows.size(); first += at_once) {
    const std::size_t count = std::min(windows.size() - first, at_once);
    for_each(x, windows.subspan(first, count), noise, first, [&](Simulation& simulation, std::size_t i) {
      if (sum != nullptr) vectors_[i].resize(x.size());
      values[i] = finite_or_nan([&] { return question(simulation, vectors_[i]); });
    });
    for (std::size_t i = 0; i < count; ++i) {
      result.loss += values[i];
      const bool fine = std::isfinite(values[i]) && (sum == nullptr || std::isfinite(vectors_[i].squaredNorm()));
      if (!fine && !result.bad) result.bad = first + i;
      if (sum != nullptr) *sum += vectors_[i];
    }
    if (result.bad) break;
  }
  const double factor = 1 / static_cast<double>(windows.size());
  result.loss *= factor;
  if (sum != nullptr) *sum *= factor;
  return result;
}

BatchSeconds WindowBatches::take_seconds() {
  BatchSeconds all;
  all.waiting = region_ * static_cast<double>(threads());
  for (std::size_t t = 0; t < threads(); ++t) {
    all.gradients += seconds_[t];
    all.waiting -= busy_[t];
    seconds_[t] = {};
    busy_[t] = 0;
  }
  region_ = 0;
  return all;
}

WindowBatches::Result WindowBatches::gradient(const Eigen::VectorXd& x, std::span<const Window> windows,
                                              const StartNoise& noise, Eigen::VectorXd& gradient) {
  const Question question = [](Simulation& simulation, Eigen::VectorXd& vector) {
    const double loss = simulation.gradient();
    vector = Eigen::Map<const Eigen::VectorXd>(simulation.gradient_vector().data(), vector.size());
    return loss;
  };
  return over(x, windows, noise, question, &gradient);
}

WindowBatches::Result WindowBatches::loss(const Eigen::VectorXd& x, std::span<const Window> windows) {
  const Question question = [](Simulation& simulation, Eigen::VectorXd&) { return simulation.loss(); };
  return over(x, windows, {}, question, nullptr);
}

bool WindowBatches::product(const Eigen::VectorXd& x, const Eigen::VectorXd& direction, std::span<const Window> windows,
                            Curvature curvature, Eigen::VectorXd& result) {
  const Question question = [&](Simulation& simulation, Eigen::VectorXd& vector) {
    simulation.hessian_vector(values_in(direction), {vector.data(), static_cast<std::size_t>(vector.size())},
                              curvature);
    return 0.0;
  };
  return !over(x, windows, {}, question, &result).bad;
}

WindowBatches::Reason WindowBatches::why_not_finite(const Eigen::VectorXd& x, const Window& window) {
  Simulation& simulation = simulations_.front();
  try {
    begin(simulation, x, window, {}, 0);
    simulation.reset();
    for (int k = 0; k < steps_ && simulation.run_to(simulation.time() + simulation.time_step()); ++k) {
    }
    simulation.gradient();
  } catch (const Unsolved& error) {
    if (error.facts().what == UnsolvedFacts::What::jump) return {"", error};
    return {error.what()};
  } catch (const NotFinite&) {
    return {};  // the states are finite, the loss or its gradient is not
  } catch (const Error& error) {
    return {error.what()};
  }
  return {};
}

}  // namespace dpde::training
