// SPDX-License-Identifier: Apache-2.0
// Runs of a scene in a NetCDF file of the tool's own format: states at equal intervals of time, with a leading
// dimension `run` where there are several. What networks and parameters are learnt from and tested on.
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

/// Attributes of variables, which data sets write: the data's own error, why there is none, and of a parameter that it
/// numbers the runs.
inline constexpr const char *attribute_of_error = "error_estimate", *attribute_of_no_error = "no_error_estimate",
                            *attribute_of_counts = "counts_runs";

/// What to read: the variables of the data, those of the scene's states that are there, and the parameters that differ
/// from run to run.
struct Trajectories {
  std::string path;
  std::vector<double> times;        // of the frames
  int every = 1;                    // steps of the scene from one frame to the next
  bool has_frames_of_data = false;  // of the task's data; else these are goals of whole runs, or there are none
  int looks = 1;  // steps from one state that losses look at to the next: those that have frames of data, or all
  std::size_t cells = 0;
  std::vector<std::string> states;        // of the scene; the others begin as the scene says
  std::vector<std::string> params;        // of the scene, with a value for each run
  std::map<std::string, double> numbers;  // of the scene that are one for all runs
  std::set<std::string> counted;          // of the first: numbers of runs, as of random fields, that have no range
  struct Run {
    /// By variable: one after the other; of a goal one for all. Copies of trajectories share them.
    std::map<std::string, std::shared_ptr<const std::vector<double>>> frames;
    std::vector<double> params;  // in the order of Trajectories::params
  };
  std::vector<Run> runs;
  /// The data's own error, root of the mean square, as the file tells it of its variables; or why there is none.
  struct OwnError {
    double value = 0;  // 0: not known
    std::string why_not;
  };
  std::map<std::string, OwnError> own_errors;
  std::vector<std::uint64_t> hashes;  // of the file, and of others that data are from
  std::uint64_t hash() const;
  double cost_s = 0;  // seconds that processors worked for them; not a number where that is not known

  int frame_count() const { return static_cast<int>(times.size()); }
  std::vector<std::string> goals;  // variables that are one array a run
  bool is_goal(const std::string& variable) const { return std::ranges::find(goals, variable) != goals.end(); }
  /// By datum, of those that are not from the file that windows begin with: what their frames are called here.
  std::map<std::string, std::string> names_of_data;
  const std::string& name_of(const model::Datum& datum) const {
    const auto other = names_of_data.find(datum.name);
    return other == names_of_data.end() ? datum.variable : other->second;
  }

  /// `count` frames of a variable from `first` on; of a goal itself, whatever the frames are.
  std::span<const double> frames(int run, const std::string& variable, int first, int count = 1) const;
  /// The standard deviation of a variable over all runs, frames and cells.
  double deviation(const std::string& variable) const;
  /// The same for steps of this length; nullopt where frames are no whole number of them apart.
  std::optional<Trajectories> in_steps_of(double step) const;
};

/// The trajectories of `file`, with all data of the problem's task. Reports cannot-read and bad-array-file at `where`,
/// and warns of data-of-other-parameter there.
std::optional<Trajectories> load_trajectories(const model::Problem& problem, const std::string& file,
                                              const SourceFile& source, SourceRange where, DiagnosticSink& sink);

/// Those that the problem's task learns from: of the file that windows begin with, and the data of others, which have
/// the same runs at the same times. Reports the same at the lines of the data.
std::optional<Trajectories> load_learnt_trajectories(const model::Problem& problem, const SourceFile& source,
                                                     DiagnosticSink& sink);

}  // namespace dpde::files
