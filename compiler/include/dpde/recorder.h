// SPDX-License-Identifier: Apache-2.0
// Records a run on disk, in the files and bytes of `dpde run --every N --out FOLDER`.
//
//   dpde::Simulation sim = dpde::compile_file("heat.dpde");
//   dpde::Recorder recorder(sim, "results", 10);
//   recorder.run();
//   recorder.finish();
//
// States are written at once to a file without a name in that folder. finish() makes the output files from it:
// SCENE.nc, on three axes SCENE.xdmf, STATE.npy and STATE_over_time.npy, observables.csv, and with gnuplot the pictures
// SCENE and SCENE_observables as .svg and .png. Each file is either complete or absent.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/progress.h"
#include "dpde/runtime/simulation.h"

namespace dpde {

/// Steps a simulation and records its states.
class Recorder {
 public:
  /// For a simulation of compile_file() or compile_text(), which must outlive the recorder and must not be moved.
  /// Recorded are the state before the first of the calls below, the state after each step whose number is a multiple
  /// of `every`, and the state at finish(). With every = 0 it records the `output` lines of the scene, as `dpde run`
  /// does without --every. The folder is made if it does not exist.
  /// @throws Error(input) for a scene of `dpde build` and for every < 0, Error(machine) if the folder cannot be made.
  Recorder(Simulation& simulation, const std::string& folder, int every);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  /// Like the functions of the simulation with these names. @throws what those throw, and Error(input) if a reset() has
  /// started another run.
  bool step(int count = 1);
  bool run_to(double time, const ProgressCallback& progress = {}, int every = 64);
  bool run(const ProgressCallback& progress = {}, int every = 64);

  /// Writes FOLDER/SCENE.restart, and SCENE.frames with the recorded states. From these resume() continues, also in a
  /// later process. Each file is either complete or absent. @throws Error(machine) if it cannot be written, Error(run)
  /// for states that are not finite.
  void checkpoint();
  /// Writes a checkpoint after each step whose number is a multiple of `steps` and whose states are finite; 0: none. A
  /// checkpoint that cannot be written does not end the run: finish() throws.
  void checkpoint_every(int steps);
  /// Continues from the checkpoint of the folder, if there is one: simulation and record then have the state in which
  /// it was written, and further steps give the same bits as a run without a stop. Returns false if there is none. Call
  /// it after all values are set and before any step. Scene, parameters, initial states, controls, coefficients and
  /// weights must be the same. Checkpoints of `dpde run` have another format.
  /// @throws Error(input) for a checkpoint that is damaged or of another run; the message says what differs.
  bool resume();

  /// Records the present state, writes the files and returns their names; also after an error of a run. A later run is
  /// a new record. @throws Error(machine) if a file or a recorded state could not be written.
  std::vector<std::string> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
