// SPDX-License-Identifier: Apache-2.0
// Start of the first training sample of a learning task, at the first frame whose state is not 0, and the frames after
// it. Derivatives are certified there: the scene's own start, which no sample uses, may be 0 everywhere.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"

namespace dpde::driver {

struct WindowStart {
  std::string path;
  int run = 0, frame = 0;
  double t = 0;   // of the frame
  int every = 1;  // steps between states used by losses
  std::size_t cells = 0;
  std::map<std::string, std::vector<double>> states;
  std::map<std::string, double> params;             // of the run
  std::map<std::string, std::vector<double>> data;  // by datum: the following frames, one after the other

  /// Number of steps that ends at such a state: `steps` rounded down, at least one interval.
  int whole_frames(int steps) const;
};

/// The first sample of a task; both members are empty if the task has no samples.
struct FirstWindow {
  std::shared_ptr<const WindowStart> start;
  std::string missing;  // why there is no sample
};

/// Reads the task's file. Reports nothing: training reports errors of the file.
FirstWindow first_window(const Compiled& compiled, const SourceFile& source);
/// "from frame 0 of run 0 of train.nc (t = 0.5)"
std::string text_of(const WindowStart& start);
/// Changes when a sample file changes; "" if the task has none.
std::string stamp_of_windows(const Compiled& compiled, const SourceFile& source);

}  // namespace dpde::driver
