// SPDX-License-Identifier: Apache-2.0
// Runs of a scene in a NetCDF file in dpde's format: states at equal time intervals, with a leading dimension `run` if
// there are several. Networks and parameters are trained and tested on them.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::files {

/// Attributes of variables in data sets: error of the data, why there is none, and whether a parameter just numbers the
/// runs.
inline constexpr const char *attribute_of_error = "error_estimate", *attribute_of_no_error = "no_error_estimate",
                            *attribute_of_counts = "counts_runs";

/// Content of the file: variables of the data, states of the scene as far as present, and parameters that differ
/// between runs.
struct Trajectories {
  std::string path;
  std::vector<double> times;        // of the frames
  int every = 1;                    // steps of the scene between frames
  bool has_frames_of_data = false;  // of the task's data; else these are goals of whole runs, or missing
  int looks = 1;                    // steps between states that losses use: those with frames of data, or all
  std::size_t cells = 0;
  std::vector<std::string> states;        // states of the scene in the file; the others begin as in the scene
  std::vector<std::string> params;        // parameters of the scene, with a value for each run
  std::map<std::string, double> numbers;  // parameters of the scene common to all runs
  std::set<std::string> counted;          // those of `params` that number the runs, without a range
  struct Run {
    /// By variable, frame after frame; a goal has one array. Shared by copies of Trajectories.
    std::map<std::string, std::shared_ptr<const std::vector<double>>> frames;
    std::vector<double> params;  // in the order of Trajectories::params
  };
  std::vector<Run> runs;
  /// RMS error of the data, as stated in the file for each variable, or why there is none.
  struct OwnError {
    double value = 0;  // 0: unknown
    std::string why_not;
  };
  std::map<std::string, OwnError> own_errors;
  std::vector<std::uint64_t> hashes;  // of the file, and of other files with data
  std::uint64_t hash() const;
  double cost_s = 0;  // CPU seconds to make them; NaN if unknown

  int frame_count() const { return static_cast<int>(times.size()); }
  std::vector<std::string> goals;  // variables with one array for each run
  bool is_goal(const std::string& variable) const { return std::ranges::find(goals, variable) != goals.end(); }
  /// By datum, for data from other files: the name of its frames here.
  std::map<std::string, std::string> names_of_data;
  const std::string& name_of(const model::Datum& datum) const {
    const auto other = names_of_data.find(datum.name);
    return other == names_of_data.end() ? datum.variable : other->second;
  }

  /// `count` frames of a variable from `first` on; for a goal its single array.
  std::span<const double> frames(int run, const std::string& variable, int first, int count = 1) const;
  /// Standard deviation of a variable over all runs, frames and cells.
  double deviation(const std::string& variable) const;
  /// The same for another step length; nullopt if frames are not an integer number of steps apart.
  std::optional<Trajectories> in_steps_of(double step) const;
};

/// The trajectories of `file`, with all data of the problem's task. Reports cannot-read and bad-array-file at `where`,
/// and warns with data-of-other-parameter there.
std::optional<Trajectories> load_trajectories(const model::Problem& problem, const std::string& file,
                                              const SourceFile& source, SourceRange where, DiagnosticSink& sink);

/// The trajectories that the problem's task learns from: the file with the first frames, and data of other files, which
/// must have the same runs and times. Reports as above, at the lines of the data.
std::optional<Trajectories> load_learnt_trajectories(const model::Problem& problem, const SourceFile& source,
                                                     DiagnosticSink& sink);

}  // namespace dpde::files
