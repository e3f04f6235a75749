// SPDX-License-Identifier: Apache-2.0
// Checkpoint files of a training: "dpdetrn5", identification, start, state to continue from, then a checksum of all
// before it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "dpde/runtime/bytes.h"
#include "stencil/text/print_stencil.h"
#include "training/trainer.h"

namespace dpde::training {

namespace {

constexpr std::string_view training_magic = "dpdetrn5";
constexpr std::array<std::string_view, 15> names_of_options{"task",      "unknowns", "length of windows",
                                                            "optimiser", "rate",     "momentum",
                                                            "decay",     "clip",     "batch",
                                                            "seed",      "unroll",   "cut",
                                                            "noise",     "validate", "number of epochs"};

std::vector<double> numbers_in(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

Eigen::VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

void write(ByteWriter& out, const TrainingState& state) {
  out.number(state.updates.made);
  out.number(state.epoch);
  out.number(state.batch);
  out.number(state.best_epoch);
  out.values({state.epoch_loss, state.best_loss, state.first_norm, state.radius});
  for (const Eigen::VectorXd* x : {&state.updates.x, &state.updates.mean, &state.updates.square, &state.best})
    out.values(numbers_in(*x));
  out.values(state.losses);
  out.number(static_cast<std::int64_t>(state.lbfgs.pairs.size()));
  out.values({state.lbfgs.loss});
  out.values(numbers_in(state.lbfgs.x));
  out.values(numbers_in(state.lbfgs.gradient));
  out.values(numbers_in(state.scale));
  for (const LbfgsState::Pair& pair : state.lbfgs.pairs) {
    out.values(numbers_in(pair.step));
    out.values(numbers_in(pair.change));
    out.values({pair.rho});
  }
  std::vector<double> epochs;
  for (const Epoch& epoch : state.epochs)
    epochs.insert(epochs.end(), {static_cast<double>(epoch.unroll), epoch.loss, epoch.validation, epoch.rate,
                                 static_cast<double>(epoch.updates)});
  out.values(epochs);
}

/// Returns false if the data do not fit `size` unknowns.
bool read(ByteReader& in, LbfgsState& state, Eigen::VectorXd& scale, Eigen::Index size) {
  const std::int64_t pairs = in.number();
  const std::vector<double> loss = in.values();
  if (loss.size() != 1 || pairs < 0 || pairs > Lbfgs{}.memory) return false;
  state.loss = loss[0];
  state.x = vector_of(in.values());
  state.gradient = vector_of(in.values());
  scale = vector_of(in.values());
  for (std::int64_t p = 0; p < pairs; ++p) {
    LbfgsState::Pair& pair = state.pairs.emplace_back();
    pair.step = vector_of(in.values());
    pair.change = vector_of(in.values());
    const std::vector<double> rho = in.values();
    if (rho.size() != 1 || pair.step.size() != size || pair.change.size() != size) return false;
    pair.rho = rho[0];
  }
  return state.x.size() == state.gradient.size() && (scale.size() == 0 || scale.size() == size) &&
         (state.x.size() == size || (state.x.size() == 0 && pairs == 0));
}

/// Returns false if the data do not fit `size` unknowns.
bool read(ByteReader& in, TrainingState& state, Eigen::Index size) {
  state.updates.made = in.number();
  state.epoch = static_cast<int>(in.number());
  state.batch = static_cast<int>(in.number());
  state.best_epoch = static_cast<int>(in.number());
  const std::vector<double> numbers = in.values();
  if (numbers.size() != 4) return false;
  state.epoch_loss = numbers[0];
  state.best_loss = numbers[1];
  state.first_norm = numbers[2];
  state.radius = numbers[3];
  for (Eigen::VectorXd* x : {&state.updates.x, &state.updates.mean, &state.updates.square, &state.best})
    *x = vector_of(in.values());
  state.losses = in.values();
  if (!read(in, state.lbfgs, state.scale, size)) return false;
  const std::vector<double> epochs = in.values();
  if (!in.is_done() || epochs.size() % 5 != 0) return false;
  for (std::size_t i = 0; i < epochs.size(); i += 5) {
    state.epochs.push_back({static_cast<int>(epochs[i]), epochs[i + 1], epochs[i + 2], epochs[i + 3],
                            static_cast<std::int64_t>(epochs[i + 4])});
  }
  const bool has_best =
      state.best_epoch < 0 ? state.best.size() == 0 || state.best.size() == size : state.best.size() == size;
  const Eigen::Index square = state.updates.square.size();
  return state.updates.x.size() == size && state.updates.mean.size() == size && (square == 0 || square == size) &&
         has_best && state.epoch >= 0 && state.batch >= 0 &&
         state.epochs.size() == static_cast<std::size_t>(state.epoch);
}

}  // namespace

namespace {

std::string newton_text(const model::Optimiser& optimiser) {
  return optimiser.gauss_newton ? "newton_cg of squares" : "newton_cg";
}

/// Whether the value is short and readable, not a hash or a long list.
bool is_for_eyes(std::string_view name) { return std::ranges::find(names_of_options, name) != names_of_options.end(); }

}  // namespace

std::string names_and_sizes(const std::vector<UnknownPart>& parts) {
  std::string text;
  for (const UnknownPart& part : parts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", part.name, part.size);
  return text;
}

/// The number of epochs is not part of it, as more may be wanted later, unless it affects the first ones.
driver::RunIdentity Trainer::identity() const {
  const model::Training& training = scene_.training();
  const std::string text = print(scene_.compiled->stencil);
  const std::vector<double> start = numbers_in(start_);
  std::string params;
  for (const model::Parameter& param : scene_.compiled->problem->params)
    params += fmt::format("{} = {}, ", param.name, param.value);
  const bool counts_epochs = rule_.schedule.kind == RateSchedule::Kind::cosine || training.unroll.size() > 1;
  return {{"task", scene_.task().name},
          {"unknowns", names_and_sizes(parts_)},
          {"model", fmt::format("hash {:016x}", hash_bytes(text.data(), text.size()))},
          {"set of trajectories", fmt::format("hash {:016x}", scene_.trajectories.hash())},
          {"content of its files", fmt::format("hash {:016x}", scene_.given_hash)},
          {"set of parameters", params},
          {"length of windows", fmt::format("{}", scene_.steps())},
          {"optimiser", is_newton()                            ? newton_text(*scene_.task().optimiser)
                        : takes_all()                          ? "lbfgs"
                        : rule_.kind == UpdateRule::Kind::adam ? "adam"
                                                               : "gradient_descent"},
          {"rate", fmt::format("{}", rule_.rate)},
          {"momentum", fmt::format("{}", rule_.momentum)},
          {"decay", fmt::format("{}", rule_.decay)},
          {"clip", fmt::format("{}", rule_.clip)},
          {"schedule", fmt::format("{} {}", static_cast<int>(rule_.schedule.kind), rule_.schedule.every)},
          {"batch", fmt::format("{}", training.batch)},
          {"seed", fmt::format("{}", seed_)},
          {"unroll", fmt::format("{}", fmt::join(training.unroll, " "))},
          {"cut", fmt::format("{}", training.cut)},
          {"noise", fmt::format("{}", training.noise)},
          {"validate", fmt::format("{}", training.validate)},
          {"number of epochs", counts_epochs ? fmt::format("{}", epochs_) : ""},
          {"start", fmt::format("hash {:016x}", hash_bytes(start.data(), start.size() * sizeof(double)))}};
}

std::string Trainer::save() const {
  ByteWriter out;
  const driver::RunIdentity all = identity();
  out.number(static_cast<std::int64_t>(all.size()));
  for (const auto& [name, value] : all) {
    out.text(name);
    out.text(value);
  }
  out.values(numbers_in(start_));
  write(out, state_);
  return driver::sealed(std::string(training_magic) + out.bytes());
}

bool Trainer::restore(std::string_view bytes, const std::string& file, DiagnosticSink& sink) {
  const auto damaged = [&] {
    sink.report("bad-array-file", {}, {file, "it is damaged"}, "without --resume the training starts at its beginning");
    return false;
  };
  const std::optional<std::string_view> content = driver::unsealed(bytes);
  if (!content || !content->starts_with(training_magic)) return damaged();
  ByteReader in(content->substr(training_magic.size()));
  const driver::RunIdentity wanted = identity();
  if (in.number() != static_cast<std::int64_t>(wanted.size())) return damaged();
  for (const auto& [name, value] : wanted) {
    const std::string its_name = in.text(), its_value = in.text();
    if (its_name != name) return damaged();
    if (its_value == value) continue;
    const std::string values = is_for_eyes(name)
                                   ? fmt::format("it has {}, the task {}; ", its_value.empty() ? "none" : its_value,
                                                 value.empty() ? "none" : value)
                                   : "";
    sink.report("restart-differs", {}, {file, name}, values + "without --resume the training starts at its beginning");
    return false;
  }
  TrainingState state;
  const bool is_whole = std::ssize(in.values()) == start_.size() && read(in, state, start_.size());
  if (!is_whole || state.updates.square.size() != state_.updates.square.size()) return damaged();
  state_ = std::move(state);
  return true;
}

std::optional<FoundValues> found_in(std::string_view checkpoint) {
  const std::optional<std::string_view> content = driver::unsealed(checkpoint);
  if (!content || !content->starts_with(training_magic)) return std::nullopt;
  ByteReader in(content->substr(training_magic.size()));
  FoundValues found;
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    const std::string name = in.text(), value = in.text();
    if (name == "task") found.task = value;
    if (name == "unknowns") found.unknowns = value;
  }
  found.start = vector_of(in.values());
  TrainingState state;
  if (!read(in, state, found.start.size())) return std::nullopt;
  found.best = state.best_epoch < 0 ? found.start : state.best;
  found.best_loss = state.best_loss;
  return found;
}

}  // namespace dpde::training
