// SPDX-License-Identifier: Apache-2.0
#include "training/trainer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "codegen/network_table.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/random.h"
#include "dpde/runtime/unknown_scales.h"

namespace dpde::training {

namespace {

constexpr std::uint64_t order_stream = 1, noise_stream = 2;

/// Pseudo-random integer below `count`, a function of the arguments.
std::uint64_t draw(std::uint64_t seed, std::uint64_t epoch, std::uint64_t number, std::uint64_t count) {
  const auto words = philox({static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(number >> 32),
                             static_cast<std::uint32_t>(epoch), order_stream},
                            {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
  const std::uint64_t word = std::uint64_t{words[1]} << 32 | words[0];
  return word % count;  // the smallest numbers are more frequent by a relative count/2^64
}

UpdateRule rule_of(const model::Optimiser& optimiser, const model::Training& training) {
  UpdateRule rule;
  rule.kind =
      optimiser.kind == model::Optimiser::Kind::adam ? UpdateRule::Kind::adam : UpdateRule::Kind::gradient_descent;
  rule.rate = optimiser.rate;
  rule.momentum = optimiser.momentum;
  rule.decay = optimiser.decay;
  rule.clip = training.clip;
  rule.schedule.every = training.schedule.every;
  switch (training.schedule.kind) {
    case model::RateSchedule::Kind::constant: break;
    case model::RateSchedule::Kind::halve: rule.schedule.kind = RateSchedule::Kind::halve; break;
    case model::RateSchedule::Kind::cosine: rule.schedule.kind = RateSchedule::Kind::cosine; break;
  }
  return rule;
}

/// Empty if no part has bounds.
Bounds bounds_of(const std::vector<UnknownPart>& parts, Eigen::Index size) {
  if (std::ranges::none_of(parts,
                           [](const UnknownPart& part) { return std::isfinite(part.low) || std::isfinite(part.high); }))
    return {};
  Bounds bounds{Eigen::VectorXd(size), Eigen::VectorXd(size)};
  for (const UnknownPart& part : parts) {
    bounds.low.segment(part.offset, part.size).setConstant(part.low);
    bounds.high.segment(part.offset, part.size).setConstant(part.high);
  }
  return bounds;
}

/// Losses alone store no states; the memory budget is for gradients.
BatchOptions only_losses(BatchOptions options) {
  options.stores_states = false;
  return options;
}

std::size_t batch_count(std::size_t windows, int batch) {
  return (windows + static_cast<std::size_t>(batch) - 1) / static_cast<std::size_t>(batch);
}

}  // namespace

std::string describe(TrainingEnd end) {
  switch (end) {
    case TrainingEnd::epochs: return "all epochs made";
    case TrainingEnd::patience: return "no better for as many epochs as patience allows";
    case TrainingEnd::no_progress: return "no step lowers the loss any more";
    case TrainingEnd::not_finite: return "the loss or its gradient is not a finite number";
    case TrainingEnd::stopped: return "stopped";
  }
  return "";
}

std::unique_ptr<Trainer> Trainer::open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                       DiagnosticSink& sink, int trial) {
  std::unique_ptr<Trainer> trainer(new Trainer(scene, options, trial));
  const model::Training& training = scene.training();
  trainer->options_.cut = training.cut;
  trainer->rule_ = rule_of(*scene.task().optimiser, training);
  trainer->epochs_ = epochs > 0 ? epochs : training.epochs;
  if (training.unroll.size() > static_cast<std::size_t>(trainer->epochs_)) {
    sink.report("bad-option", scene.task().optimiser->origin.range,
                {fmt::format("--epochs {} is fewer than the {} lengths of unroll: the last ones would have none",
                             trainer->epochs_, training.unroll.size())},
                "more --epochs, or fewer lengths of unroll");
    return nullptr;
  }
  if (!trainer->split_runs(sink)) return nullptr;
  for (int e = 0; e < trainer->epochs_; ++e) {
    const std::size_t count = trainer->windows_of(trainer->unroll_of(e)).size();
    trainer->updates_in_all_ +=
        trainer->takes_all() ? 1 : static_cast<std::int64_t>(batch_count(count, training.batch));
    if (count > 0) continue;
    sink.report("bad-array-file", {},
                {scene.trajectories.path,
                 fmt::format("without what is kept for validation nothing is left to learn from in windows of {} steps",
                             trainer->unroll_of(e))});
    return nullptr;
  }
  if (training.noise > 0) {
    for (const std::string& state : scene.trajectories.states)
      trainer->deviations_.push_back(training.noise * scene.trajectories.deviation(state));
  }
  trainer->start_ = trainer->batches(trainer->unroll_of(0)).unknown_values();
  trainer->parts_ = trainer->batches_->parts();
  trainer->begin_networks_anew();
  trainer->bounds_ = bounds_of(trainer->parts_, trainer->start_.size());
  trainer->bounds_.project(trainer->start_);
  trainer->state_.updates = begin_updates(trainer->rule_, trainer->start_);
  return trainer;
}

/// Draws new initial weights. Weights from a file are the same in all trials.
void Trainer::begin_networks_anew() {
  if (trial_ == 0) return;
  for (const UnknownPart& part : parts_) {
    const auto unknown = std::ranges::find(scene_.task().unknowns, part.name, &model::Unknown::name);
    if (part.kind != DPDE_UNKNOWN_NETWORK || !unknown->from.file.empty()) continue;
    const network::Network& network = *scene_.compiled->problem->find_network(part.name);
    const std::vector<double> weights = initial_weights(*codegen::NetworkTable(network).get(), network.seed + trial_);
    start_.segment(part.offset, part.size) = Eigen::Map<const Eigen::VectorXd>(weights.data(), part.size);
  }
}

/// Reserves the last runs for validation, or the last frames of a single run: training samples end before its first
/// frame. Returns false if they are too few for a sample and validation was requested.
bool Trainer::split_runs(DiagnosticSink& sink) {
  const files::Trajectories& all = scene_.trajectories;
  const int runs = static_cast<int>(all.runs.size()), steps = scene_.steps(), frames = std::max(steps / all.every, 1);
  const double share = scene_.training().validate;
  training_runs_ = runs;
  last_training_start_ = std::numeric_limits<int>::max();
  if (share <= 0) return true;
  int first = 0;
  if (runs > 1) {
    training_runs_ = runs - std::clamp(static_cast<int>(std::lround(share * runs)), 1, runs - 1);
  } else {
    first = static_cast<int>(std::lround((1 - share) * all.frame_count()));
    last_training_start_ = first;
  }
  for (int run = runs > 1 ? training_runs_ : 0; run < runs; ++run) {
    for (int frame = first; frame < scene_.starts(steps); frame += frames) validation_.push_back({run, frame});
  }
  if (!validation_.empty()) return true;
  const model::Datum* datum = scene_.task().datum_of_windows();
  sink.report("bad-array-file", datum->origin.range,
              {all.path, fmt::format("its last {} frames, kept for validation, are shorter than a window of {} steps",
                                     all.frame_count() - first, steps)},
              "a larger share to validate, more runs or longer ones");
  return false;
}

/// Each length gets an equal share of the epochs.
int Trainer::unroll_of(int epoch) const {
  const std::vector<int>& lengths = scene_.training().unroll;
  if (lengths.empty()) return scene_.steps();
  const std::size_t phase =
      static_cast<std::size_t>(epoch) * lengths.size() / static_cast<std::size_t>(std::max(epochs_, epoch + 1));
  return lengths[phase];
}

std::vector<Window> Trainer::windows_of(int unroll) const {
  std::vector<Window> all;
  const int every = scene_.trajectories.every, frames = (unroll + every - 1) / every;
  for (int run = 0; run < training_runs_; ++run) {
    for (int frame = 0; frame < scene_.starts(unroll); ++frame) {
      if (frame <= last_training_start_ - frames) all.push_back({run, frame});
    }
  }
  return all;
}

std::size_t Trainer::windows(int epoch) const { return windows_of(unroll_of(epoch)).size(); }

/// Shuffled (Fisher-Yates).
const std::vector<Window>& Trainer::order_of(int epoch) {
  if (order_epoch_ == epoch) return order_;
  order_epoch_ = epoch;
  order_ = windows_of(unroll_of(epoch));
  for (std::size_t i = order_.size(); i > 1; --i) {
    std::swap(order_[i - 1], order_[draw(seed_, static_cast<std::uint64_t>(epoch), i, i)]);
  }
  return order_;
}

WindowBatches& Trainer::batches(int unroll) {
  if (!batches_ || batches_->steps() != unroll) {
    batches_.reset();  // frees its memory first
    batches_ = std::make_unique<WindowBatches>(scene_, unroll, largest_batch(), options_);
  }
  return *batches_;
}

void Trainer::diverge(std::span<const Window> batch, std::size_t bad, const Eigen::VectorXd& x) {
  end_ = TrainingEnd::not_finite;
  divergence_ = Divergence{static_cast<int>(state_.updates.made), state_.epoch, batch[bad],
                           batches(unroll_of(state_.epoch)).why_not_finite(x, batch[bad])};
}

/// Returns false if the training ends here.
bool Trainer::make_update(std::span<const Window> batch, std::size_t first) {
  const auto epoch = static_cast<std::uint64_t>(state_.epoch);
  const StartNoise noise{deviations_, seed_ ^ noise_stream << 32, epoch << 32 | first};
  Eigen::VectorXd gradient(start_.size());
  const WindowBatches::Result result =
      batches(unroll_of(state_.epoch)).gradient(state_.updates.x, batch, noise, gradient);
  if (is_stopping()) {
    end_ = TrainingEnd::stopped;
    return false;
  }
  if (result.bad) {
    diverge(batch, *result.bad, state_.updates.x);
    return false;
  }
  update(rule_, state_.updates, gradient, updates_in_all_, bounds_);
  state_.losses.push_back(result.loss);
  state_.epoch_loss += result.loss;
  ++state_.batch;
  return true;
}

/// Returns false if the training ends here.
bool Trainer::end_epoch() {
  Epoch epoch{unroll_of(state_.epoch), state_.epoch_loss / std::max(state_.batch, 1), std::nan(""),
              rule_.rate * rule_.schedule.factor(state_.updates.made - 1, updates_in_all_), state_.updates.made};
  double judged = epoch.loss;
  if (!validation_.empty()) {
    // After --resume at the end of an epoch the samples may have another length.
    WindowBatches* full = batches_ && batches_->steps() == scene_.steps() ? batches_.get() : nullptr;
    if (full == nullptr) {
      if (!full_)
        full_ = std::make_unique<WindowBatches>(scene_, scene_.steps(), largest_batch(), only_losses(options_));
      full = full_.get();
    }
    const WindowBatches::Result result = full->loss(state_.updates.x, validation_);
    if (is_stopping()) {
      end_ = TrainingEnd::stopped;
      return false;
    }
    judged = epoch.validation = result.loss;  // not finite: no better than any other
  }
  const bool compares = !validation_.empty() || state_.epochs.empty() || state_.epochs.back().unroll == epoch.unroll;
  if (!compares) {  // losses over samples of another length are not comparable
    state_.best_loss = std::numeric_limits<double>::infinity();
    state_.best_epoch = -1;
  }
  if (judged < state_.best_loss) {
    state_.best_loss = judged;
    state_.best = state_.updates.x;
    state_.best_epoch = state_.epoch;
  }
  state_.epochs.push_back(epoch);
  ++state_.epoch;
  state_.batch = 0;
  state_.epoch_loss = 0;
  return true;
}

/// From the training's start and its first gradient.
Eigen::VectorXd Trainer::scale_at(const Eigen::VectorXd& gradient) const {
  std::vector<UnknownScale> scales;
  for (const UnknownPart& part : parts_) scales.push_back({part.offset, part.size});
  return scale_of(scales_of(start_, std::move(scales), bounds_), gradient);
}

/// One iteration over all samples, in the order of the file: the loss is then a function, as a line search needs.
bool Trainer::iterate_over_all() {
  const std::vector<Window> all = windows_of(unroll_of(state_.epoch));
  std::size_t bad = 0;
  const Objective loss_of_all = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    if (is_stopping()) return std::nan("");
    const WindowBatches::Result result = batches(unroll_of(state_.epoch)).gradient(x, all, {}, gradient);
    bad = result.bad.value_or(0);
    return result.bad ? std::nan("") : result.loss;
  };
  TrainingState next = state_;
  if (next.lbfgs.x.size() == 0) {
    next.lbfgs.x = state_.updates.x;
    next.lbfgs.gradient.resize(start_.size());
    next.lbfgs.loss = loss_of_all(next.lbfgs.x, next.lbfgs.gradient);
    if (!is_newton()) next.scale = scale_at(next.lbfgs.gradient);
  }
  const double before = next.lbfgs.loss;
  const bool is_lower = std::isfinite(before) && make_iteration(next, all, loss_of_all);
  if (is_stopping()) {
    end_ = TrainingEnd::stopped;
    return false;
  }
  if (!std::isfinite(before)) {
    diverge(all, bad, state_.updates.x);
    return false;
  }
  end_ = TrainingEnd::no_progress;
  if (!is_lower) return false;
  state_ = std::move(next);
  state_.losses.push_back(before);
  state_.updates.x = state_.lbfgs.x;
  ++state_.updates.made;
  state_.epoch_loss = state_.lbfgs.loss;
  state_.batch = 1;
  return true;
}

/// Returns false if no step lowers the loss.
bool Trainer::make_iteration(TrainingState& next, std::span<const Window> all, const Objective& loss) {
  LbfgsState& at = next.lbfgs;
  if (!is_newton()) return iterate(Lbfgs{}, at, next.scale, loss, bounds_);
  const Curvature curvature = scene_.task().optimiser->gauss_newton ? Curvature::gauss_newton : Curvature::full;
  const HessianProduct product = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    const bool is_finite = !is_stopping() && batches(unroll_of(state_.epoch)).product(x, v, all, curvature, result);
    if (!is_finite) result.fill(std::nan(""));
  };
  NewtonCgState newton{at.x, at.gradient, at.loss, next.first_norm, next.radius};
  const bool is_lower = iterate(NewtonCg{}, newton, loss, product, bounds_);
  at.x = std::move(newton.x);
  at.gradient = std::move(newton.gradient);
  at.loss = newton.loss;
  next.first_norm = newton.first_norm;
  next.radius = newton.radius;
  return is_lower;
}

/// Also ends the epoch after its last update. Returns false if the training ends here.
bool Trainer::make_next_update() {
  if (takes_all()) return (state_.batch > 0 || iterate_over_all()) && end_epoch();
  const auto size = static_cast<std::size_t>(scene_.training().batch);
  const std::span<const Window> order = order_of(state_.epoch);
  const std::size_t first = static_cast<std::size_t>(state_.batch) * size;
  if (first < order.size() && !make_update(order.subspan(first, std::min(size, order.size() - first)), first))
    return false;
  return first + size < order.size() || end_epoch();
}

TrainingEnd Trainer::run(const Watch& watch) {
  while (state_.epoch < epochs_) {
    if (is_out_of_patience()) return TrainingEnd::patience;
    if (!make_next_update()) return end_;
    if (!watch(*this)) return TrainingEnd::stopped;
  }
  return TrainingEnd::epochs;
}

void Trainer::free_memory() {
  batches_.reset();
  full_.reset();
}

UpdateSeconds Trainer::time_updates(int repeats) {
  const std::vector<Window> all = windows_of(scene_.steps());
  constexpr int most = 64;
  const std::size_t size = std::min(all.size(), static_cast<std::size_t>(takes_all() ? most : largest_batch()));
  WindowBatches& those = batches(scene_.steps());
  UpdateState state = state_.updates;
  Eigen::VectorXd gradient(start_.size());
  std::vector<UpdateSeconds> samples;
  for (int r = 0; r <= repeats && !is_stopping(); ++r) {  // the first one touches new memory
    UpdateSeconds seconds;
    seconds.windows = size;
    {
      const Stopwatch whole(&seconds.all);
      those.gradient(state.x,
                     std::span(all).subspan(static_cast<std::size_t>(r) * size % (all.size() - size + 1), size), {},
                     gradient);
      update(rule_, state, gradient, updates_in_all_, bounds_);
    }
    seconds.all *= static_cast<double>(those.threads());
    seconds.batch = those.take_seconds();
    if (r > 0) samples.push_back(seconds);
  }
  const auto fastest = std::ranges::min_element(samples, {}, &UpdateSeconds::all);
  return fastest == samples.end() ? UpdateSeconds{} : *fastest;
}

/// If sample lengths grow, every length is used.
bool Trainer::is_out_of_patience() const {
  const int patience = scene_.training().patience;
  if (patience == 0 || state_.batch != 0 || state_.best_epoch < 0 || unroll_of(state_.epoch) != unroll_of(epochs_ - 1))
    return false;
  return state_.epoch - state_.best_epoch > patience;
}

}  // namespace dpde::training
