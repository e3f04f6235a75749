// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/dry_engine.h"

#include <algorithm>

#include "driver/compile/links.h"
#include "driver/memory/cost.h"
#include "driver/scene/scene_table.h"

namespace dpde::driver {

DryEngine::DryEngine(const Compiled& compiled, const StorageOptions& options) : tables_(compiled.loop, {}, nullptr) {
  for (const LinkedProgram& derivative : linked_programs(compiled))
    tables_.set_links(derivative.program, derivative.links);
  const std::shared_ptr<const SceneTable> table = SceneTable::without_code(compiled, tables_);
  EngineOptions wanted;
  wanted.threads = options.threads;
  wanted.checkpoint_bytes = budget_of_states(options);
  wanted.checkpoint_folder = options.checkpoint_folder;
  wanted.halo = halo_of(compiled);
  wanted.count = count_;
  engine_.emplace(table->scene(), std::move(wanted), table);
}

/// A loss that adds to an average may depend on data alone.
bool DryEngine::has_gradient() const {
  const dpde_scene& scene = engine_->scene();
  return scene.adjoint != nullptr &&
         std::all_of(scene.losses, scene.losses + scene.loss_count, [](const dpde_loss& loss) {
           return loss.loss != nullptr && (loss.adjoint != nullptr || loss.average != nullptr);
         });
}

void DryEngine::execute(const std::string& name) {
  if (const dpde_program* const found = program(name)) {
    Workspace::Bound states;
    for (const Engine::State& state : engine_->states()) states[state.name] = nullptr;
    engine_->workspace().execute(*found, engine_->t_begin(), states);
  }
}

void DryEngine::release(const std::string& name) {
  if (const dpde_program* const found = program(name)) engine_->workspace().release(*found);
}

}  // namespace dpde::driver
