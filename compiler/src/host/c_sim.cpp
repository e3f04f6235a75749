// SPDX-License-Identifier: Apache-2.0
// dpde_c.h: simulations. Each call is one of Simulation's.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "host/c_handles.h"

dpde_sim::dpde_sim(dpde::host::Opened opened)
    : simulation(std::move(opened.simulation)),
      params(simulation.params()),
      states(simulation.states()),
      outputs(simulation.outputs()),
      fields(simulation.fields()),
      networks(simulation.networks()),
      unknowns(simulation.unknowns()),
      seeds(std::move(opened.seeds)),
      warnings_text(std::move(opened.warnings_text)),
      warnings_json(dpde::host::json_of(opened.warnings)) {
  std::erase_if(fields, [&](const std::string& name) { return std::ranges::find(seeds, name) != seeds.end(); });
}

namespace dpde::host {

namespace {

HostBackend backend_of(int32_t backend) {
  switch (backend) {
    case DPDE_BACKEND_JIT: return HostBackend::jit;
    case DPDE_BACKEND_CPP: return HostBackend::cpp;
    case DPDE_BACKEND_INTERPRETER: return HostBackend::interpreter;
    default: refuse(fmt::format("there is no back end {}", backend));
  }
}

HostOptions options_of(const dpde_options& from) {
  if (from.version < 1 || from.version > DPDE_C_VERSION)
    refuse(fmt::format("options of version {}: this library knows up to {}; dpde_options_init() sets it", from.version,
                       DPDE_C_VERSION));
  HostOptions to;
  if (from.name != nullptr) to.name = from.name;
  if (from.scheme != nullptr) to.scheme = from.scheme;
  for (const char* const* key = from.set; key != nullptr && key[0] != nullptr; key += 2) {
    if (key[1] == nullptr) refuse(fmt::format("the setting {} has no value", key[0]));
    to.set[key[0]] = key[1];
  }
  for (const char* const* input = from.inputs; input != nullptr && *input != nullptr; ++input)
    to.inputs.emplace_back(*input);
  to.backend = backend_of(from.backend);
  to.threads = from.threads;
  to.slots = from.slots;
  to.force = from.force != 0;
  if (from.certify >= 0) to.certify = from.certify != 0;
  to.second_order = from.second_order != 0;
  to.checkpoint_bytes = from.checkpoint_bytes;
  return to;
}

const char* text_of(const char* name) { return name == nullptr ? "" : name; }

/// Name of the datum that is the seed of a state.
const std::string& seed_of(const dpde_sim& sim, std::string_view state) {
  if (sim.seeds.empty()) refuse("seeds are of scenes that were opened with inputs");
  const auto found = std::ranges::find(sim.states, state);
  if (found == sim.states.end())
    refuse(fmt::format("there is no state {}; there is {}", state, fmt::join(sim.states, ", ")));
  return sim.seeds[static_cast<std::size_t>(found - sim.states.begin())];
}

[[noreturn]] void refuse_kind(int32_t kind, const char* why) { refuse(fmt::format("values of kind {} {}", kind, why)); }

void set(dpde_sim& sim, int32_t kind, const char* name, Values values) {
  switch (kind) {
    case DPDE_PARAM:
      if (values.size() != 1) refuse(fmt::format("parameter {} is one value, not {}", name, values.size()));
      return sim.simulation.set(name, values[0]);
    case DPDE_STATE: return sim.simulation.set_state(name, values);
    case DPDE_INITIAL: return sim.simulation.set_initial(name, values);
    case DPDE_FIELD: return sim.simulation.set_field(name, values);
    case DPDE_CONTROL: return sim.simulation.set_control(name, values);
    case DPDE_WEIGHTS: return sim.simulation.set_weights(name, values);
    case DPDE_SEED: return sim.simulation.set_field(seed_of(sim, name), values);
    default: refuse_kind(kind, "cannot be set");
  }
}

void copy_to(std::string_view name, std::span<const double> values, std::span<double> to) {
  if (values.size() != to.size()) refuse(fmt::format("{} has {} values, not {}", name, values.size(), to.size()));
  std::ranges::copy(values, to.begin());
}

void get(dpde_sim& sim, int32_t kind, const char* name, std::span<double> to) {
  switch (kind) {
    case DPDE_PARAM: {
      const double value = sim.simulation.param(name);
      return copy_to(name, {&value, 1}, to);
    }
    case DPDE_STATE: return sim.simulation.state(name, to);
    case DPDE_INITIAL: return copy_to(name, sim.simulation.initial(name), to);
    case DPDE_OUTPUT: return copy_to(name, sim.simulation.output(name), to);
    case DPDE_CONTROL: return copy_to(name, sim.simulation.control(name), to);
    case DPDE_WEIGHTS: return copy_to(name, sim.simulation.weights(name), to);
    case DPDE_UNKNOWN: return copy_to(name, sim.simulation.value_of(name), to);
    case DPDE_GRADIENT:
      if (!sim.has_gradient) refuse("there is no gradient: dpde_sim_gradient() was not called, failed or was stopped");
      return copy_to(name, sim.simulation.gradient_of(name), to);
    default: refuse_kind(kind, "cannot be read");
  }
}

std::size_t size_of(dpde_sim& sim, int32_t kind, const char* name) {
  switch (kind) {
    case DPDE_PARAM: return sim.simulation.param(name), 1;
    case DPDE_STATE:
    case DPDE_INITIAL:
      if (std::ranges::find(sim.states, name) == sim.states.end())
        refuse(fmt::format("there is no state {}; there is {}", name, fmt::join(sim.states, ", ")));
      return sim.simulation.size();
    case DPDE_SEED: return seed_of(sim, name), sim.simulation.size();
    case DPDE_OUTPUT:
      if (std::ranges::find(sim.outputs, name) == sim.outputs.end())
        refuse(fmt::format("there is no output {} with a formula; there is {}", name,
                           sim.outputs.empty() ? "none" : fmt::format("{}", fmt::join(sim.outputs, ", "))));
      return sim.simulation.size();
    case DPDE_FIELD: return sim.simulation.field_size(name);
    case DPDE_CONTROL: return sim.simulation.control(name).size();
    case DPDE_WEIGHTS: return sim.simulation.weights(name).size();
    case DPDE_UNKNOWN:
    case DPDE_GRADIENT: return sim.simulation.gradient_of(name).size();
    default: refuse_kind(kind, "have no size of their own");
  }
}

Recorder& recorder_of(dpde_sim& sim) {
  if (!sim.recorder) refuse("the simulation is not recorded: dpde_sim_record() begins that");
  return *sim.recorder;
}

void require(bool reached_end) {
  if (!reached_end) throw Stopped();
}

/// Runs a loss, gradient or product that a watch may stop.
template <class Call>
auto watched(dpde_sim& sim, const Call& call) {
  sim.was_stopped = false;
  const auto result = call();
  require(!sim.was_stopped);
  return result;
}

}  // namespace
}  // namespace dpde::host

using namespace dpde;

void dpde_options_init(dpde_options* options, int32_t version) {
  if (options == nullptr) return;
  *options = {};
  options->version = version;
  options->threads = 1;
  options->certify = -1;
  options->checkpoint_bytes = std::numeric_limits<int64_t>::max();
}

dpde_sim* dpde_model_open(const dpde_model* model, const dpde_options* options, dpde_error** error) {
  std::unique_ptr<dpde_sim> sim;
  host::guarded(error, [&] {
    if (model == nullptr || options == nullptr) host::refuse("there is no model, or there are no options: NULL");
    sim = std::make_unique<dpde_sim>(host::open(model->source, host::options_of(*options)));
  });
  return sim.release();
}

void dpde_sim_free(dpde_sim* sim) { delete sim; }

const char* dpde_sim_warnings_text(const dpde_sim* sim) { return sim == nullptr ? "" : sim->warnings_text.c_str(); }
const char* dpde_sim_warnings_json(const dpde_sim* sim) { return sim == nullptr ? "[]" : sim->warnings_json.c_str(); }

const char* dpde_sim_growth(const dpde_sim* sim) { return sim == nullptr ? "" : sim->simulation.growth().c_str(); }

const char* dpde_sim_name(const dpde_sim* sim, int32_t kind, size_t index) {
  if (sim == nullptr) return nullptr;
  const std::vector<std::string>* names = nullptr;
  switch (kind) {
    case DPDE_PARAM: names = &sim->params; break;
    case DPDE_STATE:
    case DPDE_INITIAL: names = &sim->states; break;
    case DPDE_SEED: names = sim->seeds.empty() ? nullptr : &sim->states; break;
    case DPDE_OUTPUT: names = &sim->outputs; break;
    case DPDE_FIELD: names = &sim->fields; break;
    case DPDE_WEIGHTS: names = &sim->networks; break;
    case DPDE_UNKNOWN:
    case DPDE_GRADIENT: names = &sim->unknowns; break;
    default: break;
  }
  return names == nullptr || index >= names->size() ? nullptr : (*names)[index].c_str();
}

int32_t dpde_sim_size(dpde_sim* sim, int32_t kind, const char* name, size_t* size, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, size);
    *size = host::size_of(*sim, kind, host::text_of(name));
  });
}

int32_t dpde_sim_is_number(const dpde_sim* sim, const char* name) {
  const bool is_field = sim != nullptr && name != nullptr && std::ranges::find(sim->fields, name) != sim->fields.end();
  return is_field && sim->simulation.is_number(name) ? 1 : 0;
}

int32_t dpde_sim_set(dpde_sim* sim, int32_t kind, const char* name, const double* values, size_t size,
                     dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, values);
    host::set(*sim, kind, host::text_of(name), {values, size});
  });
}

int32_t dpde_sim_get(dpde_sim* sim, int32_t kind, const char* name, double* to, size_t size, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, to);
    host::get(*sim, kind, host::text_of(name), {to, size});
  });
}

int32_t dpde_sim_observe(dpde_sim* sim, const char* name, double* value, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, value);
    *value = sim->simulation.observe(host::text_of(name));
  });
}

size_t dpde_sim_rank(const dpde_sim* sim) { return sim == nullptr ? 0 : sim->simulation.cells().size(); }

size_t dpde_sim_cells(const dpde_sim* sim, size_t axis) {
  if (sim == nullptr) return 0;
  const std::vector<std::int64_t>& cells = sim->simulation.cells();
  return axis < cells.size() ? static_cast<size_t>(cells[axis]) : 0;
}

const char* dpde_sim_unit(const dpde_sim* sim, const char* name) {
  return sim == nullptr || name == nullptr ? "" : sim->simulation.unit(name);
}

int32_t dpde_sim_coordinates(const dpde_sim* sim, size_t axis, double* to, size_t size, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, to);
    const int number = axis < 3 ? static_cast<int>(axis) : 3;  // at most 3 axes
    host::copy_to("the axis", sim->simulation.coordinates(number), {to, size});
  });
}

double dpde_sim_time(const dpde_sim* sim) { return sim == nullptr ? NAN : sim->simulation.time(); }
double dpde_sim_time_step(const dpde_sim* sim) { return sim == nullptr ? NAN : sim->simulation.time_step(); }
int64_t dpde_sim_steps_done(const dpde_sim* sim) { return sim == nullptr ? 0 : sim->simulation.steps_done(); }

int32_t dpde_sim_reset(dpde_sim* sim, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    sim->simulation.reset();
  });
}

int32_t dpde_sim_step(dpde_sim* sim, int32_t count, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    host::require(sim->recorder ? sim->recorder->step(count) : sim->simulation.step(count));
  });
}

int32_t dpde_sim_run(dpde_sim* sim, double until, dpde_progress progress, void* user, int32_t every,
                     dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    ProgressCallback callback;
    if (progress != nullptr)
      callback = [&](const Progress& p) {
        const dpde_report report{p.step, p.steps, p.time, 0, 0};
        return progress(user, &report) != 0;
      };
    const auto run = [&](auto& runner) {
      return std::isnan(until) ? runner.run(callback, every) : runner.run_to(until, callback, every);
    };
    host::require(sim->recorder ? run(*sim->recorder) : run(sim->simulation));
  });
}

int32_t dpde_sim_record(dpde_sim* sim, const char* folder, int32_t every, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, folder);
    if (sim->recorder)
      host::refuse("the simulation is recorded already: end that record first, in C by dpde_sim_record_end()");
    sim->recorder.emplace(sim->simulation, folder, every);
  });
}

int32_t dpde_sim_record_drop(dpde_sim* sim, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    sim->recorder.reset();
  });
}

int32_t dpde_sim_record_end(dpde_sim* sim, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    host::recorder_of(*sim);
    Recorder recorder = *std::exchange(sim->recorder, std::nullopt);
    recorder.finish();
  });
}

int32_t dpde_sim_record_checkpoints(dpde_sim* sim, int32_t steps, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    host::recorder_of(*sim).checkpoint_every(steps);
  });
}

int32_t dpde_sim_record_resume(dpde_sim* sim, int32_t* found, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, found);
    *found = host::recorder_of(*sim).resume() ? 1 : 0;
  });
}

int32_t dpde_sim_loss(dpde_sim* sim, double* loss, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, loss);
    *loss = host::watched(*sim, [&] { return sim->simulation.loss(); });
  });
}

int32_t dpde_sim_gradient(dpde_sim* sim, double* loss, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, loss);
    sim->has_gradient = false;
    *loss = host::watched(*sim, [&] { return sim->simulation.gradient(); });
    sim->has_gradient = true;
  });
}

size_t dpde_sim_unknown_count(const dpde_sim* sim) {
  return sim == nullptr ? 0 : sim->simulation.gradient_vector().size();
}

int32_t dpde_sim_set_unknowns(dpde_sim* sim, const double* values, size_t size, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, values);
    sim->simulation.set_unknowns({values, size});
  });
}

int32_t dpde_sim_hessian_vector(dpde_sim* sim, const double* direction, double* product, size_t size,
                                int32_t gauss_newton, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, direction, product);
    const Curvature curvature = gauss_newton != 0 ? Curvature::gauss_newton : Curvature::full;
    host::watched(*sim, [&] {
      sim->simulation.hessian_vector({direction, size}, Target(product, size), curvature);
      return true;
    });
  });
}

int32_t dpde_sim_watch(dpde_sim* sim, dpde_progress progress, void* user, int32_t every, dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim);
    if (progress == nullptr) return sim->simulation.watch_gradients({});
    sim->simulation.watch_gradients(
        [=](const GradientProgress& p) {
          const dpde_report report{p.done, p.total, p.time, 0, 0};
          const bool goes_on = progress(user, &report) != 0;
          if (!goes_on) sim->was_stopped = true;
          return goes_on;
        },
        every);
  });
}

int32_t dpde_sim_optimise(dpde_sim* sim, int32_t iterations, dpde_progress progress, void* user, dpde_optimised* result,
                          dpde_error** error) {
  return host::guarded(error, [&] {
    host::need(sim, result);
    OptimiserCallback callback;
    if (progress != nullptr)
      callback = [&](const OptimiserProgress& p) {
        const dpde_report report{p.iteration, 0, 0, p.loss, p.gradient_norm};
        return progress(user, &report) != 0;
      };
    sim->has_gradient = false;
    const Optimised done = sim->simulation.optimise(callback, iterations);
    sim->has_gradient = std::isfinite(done.loss);  // NaN: it was stopped before the first gradient
    sim->reason = describe(done.reason);
    *result = {done.loss, done.iterations, done.evaluations, done.hessian_products, sim->reason.c_str()};
  });
}
