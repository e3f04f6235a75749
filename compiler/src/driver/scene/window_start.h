// SPDX-License-Identifier: Apache-2.0
// Where the first window of a task that learns from trajectories begins whose state is not 0: with a frame of its data;
// and the frames behind that. What derivatives are certified at: the scene's own start, which no window begins with,
// may be 0 everywhere.
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
  int every = 1;  // steps from one state that losses look at to the next
  std::size_t cells = 0;
  std::map<std::string, std::vector<double>> states;
  std::map<std::string, double> params;             // of the run
  std::map<std::string, std::vector<double>> data;  // by datum: the frames behind, one after the other

  /// So many steps that they end with such a state: `steps`, or the next number below, and at least one of them.
  int whole_frames(int steps) const;
};

/// What is known of the first window of a task: neither of the two for one that has no windows.
struct FirstWindow {
  std::shared_ptr<const WindowStart> start;
  std::string missing;  // why there is none
};

/// Reads the task's file. Silent: whoever learns from the file reports what is wrong with it.
FirstWindow first_window(const Compiled& compiled, const SourceFile& source);
/// "from frame 0 of run 0 of train.nc (t = 0.5)"
std::string text_of(const WindowStart& start);
/// Changes when the file of the windows does; "" for a task that has none.
std::string stamp_of_windows(const Compiled& compiled, const SourceFile& source);

}  // namespace dpde::driver
