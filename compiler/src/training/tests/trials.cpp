// SPDX-License-Identifier: Apache-2.0
#include "training/tests/trials.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "dpde/runtime/bytes.h"
#include "driver/memory/cpu_time.h"

namespace dpde::training {

namespace {

constexpr std::string_view trials_magic =
    "dpdetrl2";  // then for each trial its seconds, and its checkpoint with length and checksum
constexpr std::string_view without_seconds = "dpdetrls";

}  // namespace

std::unique_ptr<Trials> Trials::open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                     DiagnosticSink& sink) {
  std::unique_ptr<Trials> trials(new Trials(scene, epochs, options));
  return trials->begin(sink) ? std::move(trials) : nullptr;
}

bool Trials::begin(DiagnosticSink& sink) {
  std::unique_ptr<Trainer> trainer = Trainer::open(scene_, epochs_, options_, sink, static_cast<int>(trials_.size()));
  if (trainer) trials_.push_back({std::move(trainer)});
  return !sink.has_errors();
}

/// A resumed trial that is finished ends immediately.
void Trials::run(const Watch& watch) {
  DiagnosticSink silent;  // possible errors of a trial were found with the first one
  for (std::size_t k = 0; k < static_cast<std::size_t>(count()); ++k) {
    if (k == trials_.size() && !begin(silent)) return;
    running_ = k;
    Trial& trial = trials_[k];
    const auto start = std::chrono::steady_clock::now();
    const double before = trial.cpu_seconds - driver::process_cpu_seconds();
    trial.end = trial.trainer->run([&](const Trainer&) {
      trial.cpu_seconds = before + driver::process_cpu_seconds();
      return watch(*this);
    });
    trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    trial.trainer->free_memory();
    if (trial.end == TrainingEnd::stopped) return;
  }
}

std::size_t Trials::best() const {
  const auto least =
      std::ranges::min_element(trials_, {}, [](const Trial& trial) { return trial.trainer->state().best_loss; });
  return static_cast<std::size_t>(least - trials_.begin());
}

std::int64_t Trials::made() const {
  std::int64_t sum = 0;
  for (const Trial& trial : trials_) sum += trial.trainer->state().updates.made;
  return sum;
}

std::string Trials::save() const {
  ByteWriter out;
  out.number(static_cast<std::int64_t>(trials_.size() + kept_.size()));
  const auto add = [&](double cpu_seconds, const std::string& checkpoint) {
    out.values({cpu_seconds});
    out.text(checkpoint);
  };
  for (const Trial& trial : trials_) add(trial.cpu_seconds, trial.trainer->save());
  for (const Kept& kept : kept_) add(kept.cpu_seconds, kept.checkpoint);
  return std::string(trials_magic) + out.bytes();
}

namespace {

/// Returns nullopt if it is damaged. Older files have no seconds.
std::optional<std::vector<std::pair<double, std::string>>> parts_of(std::string_view bytes) {
  const bool has_seconds = bytes.starts_with(trials_magic);
  std::vector<std::pair<double, std::string>> parts;
  if (!has_seconds && !bytes.starts_with(without_seconds)) {
    parts.emplace_back(std::nan(""), bytes);
    return parts;
  }
  ByteReader in(bytes.substr(trials_magic.size()));
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    const std::vector<double> seconds = has_seconds ? in.values() : std::vector<double>{std::nan("")};
    if (seconds.size() != 1) return std::nullopt;
    parts.emplace_back(seconds[0], in.text());
  }
  if (!in.is_done() || parts.empty()) return std::nullopt;
  return parts;
}

}  // namespace

bool Trials::restore(std::string_view bytes, const std::string& file, DiagnosticSink& sink) {
  const auto parts = parts_of(bytes);
  if (!parts) {
    sink.report("bad-array-file", {}, {file, "it is damaged"}, "without --resume the training starts at its beginning");
    return false;
  }
  for (std::size_t k = 0; k < parts->size(); ++k) {
    const auto& [seconds, checkpoint] = (*parts)[k];
    if (k >= static_cast<std::size_t>(count())) {
      kept_.push_back({seconds, checkpoint});
      continue;
    }
    if (k == trials_.size() && !begin(sink)) return false;
    if (!trials_[k].trainer->restore(checkpoint, file, sink)) return false;
    trials_[k].cpu_seconds = seconds;
    if (k > 0) trials_[k - 1].trainer->free_memory();
    running_ = k;
  }
  return true;
}

std::vector<FoundTrial> found_trials(std::string_view bytes, const std::string& file, DiagnosticSink& sink) {
  std::vector<FoundTrial> found;
  const auto parts = parts_of(bytes);
  for (std::size_t k = 0; parts && k < parts->size(); ++k) {
    const auto& [seconds, checkpoint] = (*parts)[k];
    std::optional<FoundValues> values = found_in(checkpoint);
    if (!values) break;
    found.push_back({std::move(*values), seconds});
  }
  if (parts && found.size() == parts->size()) return found;
  sink.report("bad-array-file", {}, {file, "it is damaged, or of another version of dpde"},
              "--weights takes the files of networks that optimize wrote beside it");
  return {};
}

}  // namespace dpde::training
