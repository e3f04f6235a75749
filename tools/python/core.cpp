// SPDX-License-Identifier: Apache-2.0
// dpde_c.h as a Python module, dpde._core: handles become objects, errors exceptions, arrays any object with the buffer
// protocol. The public interface is the Python code in dpde/.
//
// - Long calls release Python's lock; a second thread that uses the same simulation meanwhile is refused.
// - Between steps they check for signals, so that Ctrl-C ends them.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dpde/dpde_c.h"

namespace py = pybind11;

namespace {

struct FreeModel {
  void operator()(dpde_model* model) const { dpde_model_free(model); }
};
struct FreeSim {
  void operator()(dpde_sim* sim) const { dpde_sim_free(sim); }
};

/// Raises the exception made by dpde/errors.py.
[[noreturn]] void raise(dpde_error* error) {
  const std::unique_ptr<dpde_error, void (*)(dpde_error*)> kept(error, dpde_error_free);
  const py::object made =
      py::module_::import("dpde.errors")
          .attr("made")(dpde_error_code(error), py::str(dpde_error_text(error)), py::str(dpde_error_json(error)));
  PyErr_SetObject(py::type::of(made).ptr(), made.ptr());
  throw py::error_already_set();
}

/// The memory of a contiguous array of doubles.
class Doubles {
 public:
  Doubles(py::handle array, bool writable) {
    const int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0);
    if (PyObject_GetBuffer(array.ptr(), &view_, flags) != 0) throw py::error_already_set();
    if (view_.format != nullptr && std::string_view(view_.format) == "d") return;
    PyBuffer_Release(&view_);
    throw py::type_error("an array of float64 is wanted");
  }
  Doubles(const Doubles&) = delete;
  Doubles& operator=(const Doubles&) = delete;
  ~Doubles() { PyBuffer_Release(&view_); }
  double* data() const { return static_cast<double*>(view_.buf); }
  std::size_t size() const { return static_cast<std::size_t>(view_.len) / sizeof(double); }

 private:
  Py_buffer view_{};
};

template <class Call>
auto without_lock(const Call& call) {
  const py::gil_scoped_release released;
  return call();
}

class Model {
 public:
  static Model from_text(const std::string& text, const std::string& path) {
    dpde_error* error = nullptr;
    dpde_model* const model = without_lock([&] { return dpde_model_from_text(text.c_str(), path.c_str(), &error); });
    return Model(model, error);
  }
  static Model from_file(const std::string& path) {
    dpde_error* error = nullptr;
    dpde_model* const model = without_lock([&] { return dpde_model_from_file(path.c_str(), &error); });
    return Model(model, error);
  }
  const dpde_model* get() const { return model_.get(); }
  std::vector<std::string> names(const char* (*nth)(const dpde_model*, std::size_t)) const {
    std::vector<std::string> all;
    for (std::size_t i = 0; const char* name = nth(get(), i); ++i) all.emplace_back(name);
    return all;
  }

 private:
  Model(dpde_model* model, dpde_error* error) : model_(model) {
    if (model == nullptr) raise(error);
  }
  std::unique_ptr<dpde_model, FreeModel> model_;
};

struct Settings {
  std::string name, scheme;
  std::map<std::string, std::string> set;
  std::vector<std::string> inputs;
  int backend = DPDE_BACKEND_JIT, threads = 1, slots = 0;
  bool force = false;
  std::optional<bool> certify;
  bool second_order = false;
  std::optional<std::int64_t> checkpoint_bytes;
};

std::vector<const char*> list_of(const std::vector<std::string>& texts) {
  std::vector<const char*> list;
  for (const std::string& text : texts) list.push_back(text.c_str());
  list.push_back(nullptr);
  return list;
}

dpde_sim* opened(const Model& model, const Settings& settings) {
  std::vector<const char*> set;
  for (const auto& [key, value] : settings.set) set.insert(set.end(), {key.c_str(), value.c_str()});
  set.push_back(nullptr);
  const std::vector<const char*> inputs = list_of(settings.inputs);
  dpde_options options;
  dpde_options_init(&options, DPDE_C_VERSION);
  options.name = settings.name.c_str();
  options.scheme = settings.scheme.c_str();
  options.set = set.data();
  options.inputs = inputs.data();
  options.backend = settings.backend;
  options.threads = settings.threads;
  options.slots = settings.slots;
  options.force = settings.force ? 1 : 0;
  if (settings.certify) options.certify = *settings.certify ? 1 : 0;
  options.second_order = settings.second_order ? 1 : 0;
  if (settings.checkpoint_bytes) options.checkpoint_bytes = *settings.checkpoint_bytes;
  dpde_error* error = nullptr;
  dpde_sim* const sim = without_lock([&] { return dpde_model_open(model.get(), &options, &error); });
  if (sim == nullptr) raise(error);
  return sim;
}

class Sim {
 public:
  Sim(const Model& model, const Settings& settings) : sim_(opened(model, settings)) {}

  std::vector<std::string> names(int kind) const {
    std::vector<std::string> all;
    for (std::size_t i = 0; const char* name = dpde_sim_name(sim_.get(), kind, i); ++i) all.emplace_back(name);
    return all;
  }
  std::vector<std::size_t> cells() const {
    std::vector<std::size_t> all;
    for (std::size_t axis = 0; axis < dpde_sim_rank(sim_.get()); ++axis)
      all.push_back(dpde_sim_cells(sim_.get(), axis));
    return all;
  }
  std::size_t size(int kind, const char* name) {
    std::size_t size = 0;
    quick([&](dpde_error** error) { return dpde_sim_size(sim_.get(), kind, name, &size, error); });
    return size;
  }
  void set(int kind, const char* name, py::handle array) {
    const Doubles from(array, false);
    quick([&](dpde_error** e) { return dpde_sim_set(sim_.get(), kind, name, from.data(), from.size(), e); });
  }
  void set_number(int kind, const char* name, double value) {
    quick([&](dpde_error** error) { return dpde_sim_set(sim_.get(), kind, name, &value, 1, error); });
  }
  void get(int kind, const char* name, py::handle array) {
    const Doubles to(array, true);
    quick([&](dpde_error** error) { return dpde_sim_get(sim_.get(), kind, name, to.data(), to.size(), error); });
  }
  void coordinates(std::size_t axis, py::handle array) {
    const Doubles to(array, true);
    quick([&](dpde_error** error) { return dpde_sim_coordinates(sim_.get(), axis, to.data(), to.size(), error); });
  }
  bool is_number(const char* name) const { return dpde_sim_is_number(sim_.get(), name) != 0; }
  std::string unit(const char* name) const { return dpde_sim_unit(sim_.get(), name); }
  double observe(const char* name) {
    double value = 0;
    quick([&](dpde_error** error) { return dpde_sim_observe(sim_.get(), name, &value, error); });
    return value;
  }
  double time() const { return dpde_sim_time(sim_.get()); }
  double time_step() const { return dpde_sim_time_step(sim_.get()); }
  std::int64_t steps_done() const { return dpde_sim_steps_done(sim_.get()); }
  std::size_t unknown_count() const { return dpde_sim_unknown_count(sim_.get()); }

  void reset() {
    quick([&](dpde_error** error) { return dpde_sim_reset(sim_.get(), error); });
  }
  void step(int count) {
    slow([&](dpde_error** error) { return dpde_sim_step(sim_.get(), count, error); });
  }
  void run(std::optional<double> until, const py::object& progress, int every) {
    const double end = until.value_or(std::nan(""));
    const int interval = interval_of(every);
    slow([&](dpde_error** error) { return dpde_sim_run(sim_.get(), end, report, this, interval, error); },
         {progress, py::none(), every});
  }
  void record(const char* folder, int every) {
    quick([&](dpde_error** error) { return dpde_sim_record(sim_.get(), folder, every, error); });
  }
  void record_checkpoints(int steps) {
    quick([&](dpde_error** error) { return dpde_sim_record_checkpoints(sim_.get(), steps, error); });
  }
  bool record_resume() {
    int32_t found = 0;
    quick([&](dpde_error** error) { return dpde_sim_record_resume(sim_.get(), &found, error); });
    return found != 0;
  }
  void drop_record() {
    quick([&](dpde_error** error) { return dpde_sim_record_drop(sim_.get(), error); });
  }
  void end_record() {
    quick([&](dpde_error** error) { return dpde_sim_record_end(sim_.get(), error); });
  }
  double loss() {
    double loss = 0;
    slow([&](dpde_error** error) { return dpde_sim_loss(sim_.get(), &loss, error); },
         {py::none(), py::none(), usual_interval});
    return loss;
  }
  std::string growth() const { return dpde_sim_growth(sim_.get()); }
  py::tuple warnings() const {
    return py::make_tuple(dpde_sim_warnings_text(sim_.get()), dpde_sim_warnings_json(sim_.get()));
  }
  double gradient(const py::object& progress, int every) {
    double loss = 0;
    slow([&](dpde_error** error) { return dpde_sim_gradient(sim_.get(), &loss, error); },
         {progress, py::none(), every});
    return loss;
  }
  void hessian_vector(py::handle direction, py::handle product, bool gauss_newton, const py::object& progress,
                      int every) {
    const Doubles from(direction, false), to(product, true);
    if (from.size() != to.size()) throw py::value_error("direction and product differ in length");
    const auto call = [&](dpde_error** error) {
      return dpde_sim_hessian_vector(sim_.get(), from.data(), to.data(), to.size(), gauss_newton ? 1 : 0, error);
    };
    slow(call, {progress, py::none(), every});
  }
  py::tuple optimise(const py::object& progress, int iterations) {
    dpde_optimised done{};
    const auto call = [&](dpde_error** error) {
      return dpde_sim_optimise(sim_.get(), iterations, report_update, this, &done, error);
    };
    slow(call, {py::none(), progress, usual_interval});  // so that its gradients check for signals
    return py::make_tuple(done.loss, done.iterations, done.evaluations, done.hessian_products, done.reason);
  }

 private:
  /// One call at a time: another thread, or a progress function that calls back, is refused.
  class Turn {
   public:
    explicit Turn(std::atomic_flag& taken) : taken_(taken) {
      if (taken_.test_and_set())
        throw std::runtime_error("the scene is in use: by another thread, or progress calls back what calls it");
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() { taken_.clear(); }

   private:
    std::atomic_flag& taken_;
  };

  template <class Call>
  void quick(const Call& call) {
    const Turn turn(busy_);
    dpde_error* error = nullptr;
    if (call(&error) != DPDE_OK) raise(error);
  }

  /// The callbacks: for steps and for updates.
  struct Told {
    py::object progress = py::none(), updates = py::none();
    int every = usual_interval;
  };

  /// Steps between checks for signals; divides the interval of progress, so that no report is left out.
  static int interval_of(int every) {
    int interval = std::min(every, usual_interval);
    while (every % interval != 0) --interval;
    return interval;
  }

  template <class Call>
  void slow(const Call& call, const Told& told = {}) {
    const Turn turn(busy_);
    dpde_error* error = nullptr;
    thrown_ = nullptr;
    progress_ = told.progress;
    updates_ = told.updates;
    const int interval = interval_of(told.every);
    looks_a_call_ = told.every / interval;
    looks_ = 0;
    std::int32_t code = DPDE_OK;
    if (interval != watched_) {
      code = dpde_sim_watch(sim_.get(), report, this, interval, &error);
      watched_ = interval;
    }
    if (code == DPDE_OK) code = without_lock([&] { return call(&error); });
    progress_ = updates_ = py::none();
    if (thrown_ != nullptr) {
      dpde_error_free(error);
      std::rethrow_exception(std::exchange(thrown_, nullptr));
    }
    if (code != DPDE_OK) raise(error);
  }

  static std::int32_t report(void* user, const dpde_report* now) {
    Sim& self = *static_cast<Sim*>(user);
    const bool is_due = ++self.looks_ % self.looks_a_call_ == 0 || now->done == now->total;
    return self.tell(is_due ? &self.progress_ : nullptr, *now);
  }
  static std::int32_t report_update(void* user, const dpde_report* now) {
    Sim& self = *static_cast<Sim*>(user);
    return self.tell(&self.updates_, *now);
  }
  /// An exception of progress, or a signal, is stored until the call has ended. Without the lock no Python object is
  /// touched, not even None.
  std::int32_t tell(const py::object* progress, const dpde_report& now) {
    const py::gil_scoped_acquire locked;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress == nullptr || progress->is_none()) return 1;
      const py::object goes_on = (*progress)(now.done, now.total, now.time, now.loss, now.gradient_norm);
      return goes_on.is(py::bool_(false)) ? 0 : 1;
    } catch (...) {
      thrown_ = std::current_exception();
      return 0;
    }
  }

  std::unique_ptr<dpde_sim, FreeSim> sim_;
  std::atomic_flag busy_;
  static constexpr int usual_interval = 256;  // steps
  py::object progress_ = py::none(),
             updates_ = py::none();  // of the running call: for its steps, for an optimiser's updates
  std::exception_ptr thrown_;
  int watched_ = 0;  // steps between calls of report()
  int looks_a_call_ = 1;
  std::int64_t looks_ = 0;
};

void add_kinds(py::module_& module) {
  module.attr("PARAM") = DPDE_PARAM;
  module.attr("STATE") = DPDE_STATE;
  module.attr("INITIAL") = DPDE_INITIAL;
  module.attr("OUTPUT") = DPDE_OUTPUT;
  module.attr("FIELD") = DPDE_FIELD;
  module.attr("CONTROL") = DPDE_CONTROL;
  module.attr("WEIGHTS") = DPDE_WEIGHTS;
  module.attr("UNKNOWN") = DPDE_UNKNOWN;
  module.attr("GRADIENT") = DPDE_GRADIENT;
  module.attr("SEED") = DPDE_SEED;
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  add_kinds(module);
  module.attr("version") = dpde_c_version();
  py::class_<Model>(module, "Model")
      .def_static("from_text", &Model::from_text)
      .def_static("from_file", &Model::from_file)
      .def("scenes", [](const Model& model) { return model.names(dpde_model_scene); })
      .def("tasks", [](const Model& model) { return model.names(dpde_model_task); });
  py::class_<Settings>(module, "Settings")
      .def(py::init<>())
      .def_readwrite("name", &Settings::name)
      .def_readwrite("scheme", &Settings::scheme)
      .def_readwrite("set", &Settings::set)
      .def_readwrite("inputs", &Settings::inputs)
      .def_readwrite("backend", &Settings::backend)
      .def_readwrite("threads", &Settings::threads)
      .def_readwrite("slots", &Settings::slots)
      .def_readwrite("force", &Settings::force)
      .def_readwrite("certify", &Settings::certify)
      .def_readwrite("second_order", &Settings::second_order)
      .def_readwrite("checkpoint_bytes", &Settings::checkpoint_bytes);
  py::class_<Sim>(module, "Sim")
      .def(py::init<const Model&, const Settings&>())
      .def("warnings", &Sim::warnings)
      .def("growth", &Sim::growth)
      .def("names", &Sim::names)
      .def("cells", &Sim::cells)
      .def("size", &Sim::size)
      .def("set", &Sim::set)
      .def("set_number", &Sim::set_number)
      .def("get", &Sim::get)
      .def("coordinates", &Sim::coordinates)
      .def("is_number", &Sim::is_number)
      .def("unit", &Sim::unit)
      .def("observe", &Sim::observe)
      .def("time", &Sim::time)
      .def("time_step", &Sim::time_step)
      .def("steps_done", &Sim::steps_done)
      .def("unknown_count", &Sim::unknown_count)
      .def("reset", &Sim::reset)
      .def("step", &Sim::step)
      .def("run", &Sim::run)
      .def("record", &Sim::record)
      .def("record_checkpoints", &Sim::record_checkpoints)
      .def("record_resume", &Sim::record_resume)
      .def("drop_record", &Sim::drop_record)
      .def("end_record", &Sim::end_record)
      .def("loss", &Sim::loss)
      .def("gradient", &Sim::gradient)
      .def("hessian_vector", &Sim::hessian_vector)
      .def("optimise", &Sim::optimise);
}
