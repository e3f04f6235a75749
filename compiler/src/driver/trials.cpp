// SPDX-License-Identifier: Apache-2.0
#include "driver/trials.h"

#include <algorithm>
#include <chrono>

namespace dpde::driver {

namespace {

constexpr std::string_view magic = "dpdetrls";  // then the checkpoints of the trials, each with its length and its own checksum

}  // namespace

std::unique_ptr<Trials> Trials::open(const TrainingScene& scene, int epochs, const BatchOptions& options, DiagnosticSink& sink) {
  std::unique_ptr<Trials> trials(new Trials(scene, epochs, options));
  return trials->begin(sink) ? std::move(trials) : nullptr;
}

bool Trials::begin(DiagnosticSink& sink) {
  std::unique_ptr<Trainer> trainer = Trainer::open(scene_, epochs_, options_, sink, static_cast<int>(trials_.size()));
  if (trainer) trials_.push_back({std::move(trainer)});
  return !sink.has_errors();
}

/// One that is over and was taken up again ends at once.
void Trials::run(const Watch& watch) {
  DiagnosticSink silent;  // what can be wrong with a trial is wrong with the first one
  for (std::size_t k = 0; k < static_cast<std::size_t>(count()); ++k) {
    if (k == trials_.size() && !begin(silent)) return;
    running_ = k;
    Trial& trial = trials_[k];
    const auto start = std::chrono::steady_clock::now();
    trial.end = trial.trainer->run([&](const Trainer&) { return watch(*this); });
    trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    trial.trainer->free_memory();
    if (trial.end == TrainingEnd::stopped) return;
  }
}

std::size_t Trials::best() const {
  const auto least = std::ranges::min_element(trials_, {}, [](const Trial& trial) { return trial.trainer->state().best_loss; });
  return static_cast<std::size_t>(least - trials_.begin());
}

std::int64_t Trials::made() const {
  std::int64_t sum = 0;
  for (const Trial& trial : trials_) sum += trial.trainer->state().updates.made;
  return sum;
}

std::string Trials::save() const {
  if (trials_.size() == 1) return trials_[0].trainer->save();
  ByteWriter out;
  out.number(static_cast<std::int64_t>(trials_.size()));
  for (const Trial& trial : trials_) out.text(trial.trainer->save());
  return std::string(magic) + out.bytes();
}

bool Trials::restore(std::string_view bytes, const std::string& file, DiagnosticSink& sink) {
  if (!bytes.starts_with(magic)) return trials_[0].trainer->restore(bytes, file, sink);
  ByteReader in(bytes.substr(magic.size()));
  const std::int64_t there = in.number();
  std::vector<std::string> parts;
  for (std::int64_t k = 0; k < there && in.is_fine(); ++k) parts.push_back(in.text());
  if (!in.is_done() || parts.empty()) {
    sink.report("bad-array-file", {}, {file, "it is damaged"}, "without --resume the training starts at its beginning");
    return false;
  }
  for (std::size_t k = 0; k < std::min(parts.size(), static_cast<std::size_t>(count())); ++k) {
    if (k == trials_.size() && !begin(sink)) return false;
    if (!trials_[k].trainer->restore(parts[k], file, sink)) return false;
    if (k > 0) trials_[k - 1].trainer->free_memory();
    running_ = k;
  }
  return true;
}

}  // namespace dpde::driver
