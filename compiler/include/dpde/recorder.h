// SPDX-License-Identifier: Apache-2.0
// What a run goes through, on disk, in the files that `dpde run --every N --out FOLDER` writes, to the byte.
//
//   dpde::Simulation sim = dpde::compile_file("heat.dpde");
//   dpde::Recorder recorder(sim, "results", 10);
//   recorder.run();
//   recorder.finish();
//
// States go to a file without a name in that folder as they come; finish() makes the others of it: SCENE.nc, on three
// axes SCENE.xdmf, STATE.npy and STATE_over_time.npy, observables.csv, and with gnuplot the pictures SCENE and
// SCENE_observables as .svg and .png. Each is whole or not there.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/progress.h"
#include "dpde/runtime/simulation.h"

namespace dpde {

class Recorder {
 public:
  /// Of a simulation that compile_file() or compile_text() made, which stays where it is. Recorded are the state that
  /// the first of the calls below begins with, that of each step whose number `every` divides, and the one at finish();
  /// for every = 0 what the `output` lines of the scene say, as `dpde run` does without --every. The folder is made
  /// where there is none.
  /// @throws Error(input) for a scene of `dpde build` and for every < 0, Error(machine) when there can be no folder.
  Recorder(Simulation& simulation, const std::string& folder, int every);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  /// As those of the simulation. @throws what they do; and Error(input) where a reset() has begun another run.
  bool step(int count = 1);
  bool run_to(double time, const ProgressCallback& progress = {}, int every = 64);
  bool run(const ProgressCallback& progress = {}, int every = 64);

  /// Writes FOLDER/SCENE.restart, and SCENE.frames with the recorded states: what resume() goes on from, in a process
  /// that may follow a kill. Each is whole or not there. @throws Error(machine), Error(run) for states that are not
  /// finite
  void checkpoint();
  /// The same behind each step whose number `steps` divides and whose states are finite; 0: none. What cannot be
  /// written does not end the run: finish() says so.
  void checkpoint_every(int steps);
  /// Where the folder has a checkpoint of the same scene, parameters, initial states, controls, coefficients and
  /// weights, simulation and record stand where it was written, and steps give the same bits as without a stop; false:
  /// there is none. Before anything is recorded, and behind what the host sets. Those of `dpde run` are of another
  /// kind.
  /// @throws Error(input) for one that is damaged or of another run, which it names.
  bool resume();

  /// Records the present state too and writes the files, also after an error of a run: the names of what it wrote. A
  /// run behind it is recorded anew. @throws Error(machine) where a file, or the states on their way, could not be
  /// written.
  std::vector<std::string> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
