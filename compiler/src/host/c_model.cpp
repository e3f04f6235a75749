// SPDX-License-Identifier: Apache-2.0
// dpde_c.h: errors and models.
#include <fmt/format.h>

#include <memory>

#include "driver/compile/lone_models.h"
#include "files/imports.h"
#include "host/c_handles.h"
#include "host/told.h"
#include "model/from_ast.h"
#include "support/json.h"
#include "syntax/parser.h"

namespace dpde::host {

namespace {

int32_t code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::input: return DPDE_ERROR_INPUT;
    case ErrorKind::run: return DPDE_ERROR_RUN;
    case ErrorKind::machine: return DPDE_ERROR_MACHINE;
  }
  return DPDE_ERROR_MACHINE;
}

dpde_error described(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const Stopped&) {
    return {DPDE_ERROR_STOPPED, "stopped"};
  } catch (const NotFinite& e) {
    return {DPDE_ERROR_NOT_FINITE, e.what(), json_of(e.messages())};
  } catch (const Error& e) {
    return {code_of(e.kind()), e.what(), json_of(e.messages())};
  } catch (const std::bad_alloc&) {
    return {DPDE_ERROR_MACHINE, "there is not enough memory"};
  } catch (const std::exception& e) {
    return {DPDE_ERROR_MACHINE, e.what()};
  }
}

/// @throws Error for the first invalid scene or task; an error in a model would otherwise be repeated with each scene.
dpde_model understood(SourceFile text) {
  DiagnosticSink sink;
  dpde_model model{files::with_imports(text, sink), {}, {}};
  if (sink.has_errors()) fail(model.source, sink);
  const ast::File file = ast::parse(model.source, sink);
  if (sink.has_errors() || !model::check_block_names(file, sink)) fail(model.source, sink);
  model.scenes = model::scene_names(file);
  if (model.scenes.empty()) driver::check_lone_models(file, model.source, sink);
  if (sink.has_errors()) fail(model.source, sink);
  model.tasks = model::task_names(file);
  for (const std::vector<std::string>* names : {&model.scenes, &model.tasks}) {
    for (const std::string& name : *names) {
      model::from_ast(file, {.name = name}, sink);
      if (sink.has_errors()) fail(model.source, sink);
    }
  }
  model.source = std::move(text);  // imports are read again when a scene is opened
  return model;
}

template <class Read>
dpde_model* made(dpde_error** error, const Read& read) {
  std::unique_ptr<dpde_model> model;
  guarded(error, [&] { model = std::make_unique<dpde_model>(understood(read())); });
  return model.release();
}

const char* name_in(const std::vector<std::string>& names, size_t index) {
  return index < names.size() ? names[index].c_str() : nullptr;
}

}  // namespace

dpde_error* error_of_exception() noexcept {
  try {
    return new dpde_error(described(std::current_exception()));
  } catch (...) {
    return nullptr;
  }
}

std::string json_of(const std::vector<Message>& messages) {
  Json all = Json::array();
  for (const Message& m : messages) {
    all.push_back(Json{{"code", m.code},
                       {"severity", m.severity},
                       {"message", m.text},
                       {"file", m.file},
                       {"line", m.line},
                       {"column", m.column},
                       {"hint", m.hint}});
  }
  return all.dump();
}

void refuse(const std::string& why) { throw Error(ErrorKind::input, why); }

}  // namespace dpde::host

using namespace dpde;

int32_t dpde_c_version(void) { return DPDE_C_VERSION; }

int32_t dpde_error_code(const dpde_error* error) { return error == nullptr ? DPDE_OK : error->code; }
const char* dpde_error_text(const dpde_error* error) { return error == nullptr ? "" : error->text.c_str(); }
const char* dpde_error_json(const dpde_error* error) { return error == nullptr ? "[]" : error->json.c_str(); }
void dpde_error_free(dpde_error* error) { delete error; }

dpde_model* dpde_model_from_text(const char* text, const char* path, dpde_error** error) {
  return host::made(error, [&] {
    if (text == nullptr) host::refuse("there is no text: NULL");
    return SourceFile(path == nullptr ? "text.dpde" : path, text);
  });
}

dpde_model* dpde_model_from_file(const char* path, dpde_error** error) {
  return host::made(error, [&] {
    if (path == nullptr) host::refuse("there is no path: NULL");
    return host::read(path);
  });
}

const char* dpde_model_scene(const dpde_model* model, size_t index) {
  return model == nullptr ? nullptr : host::name_in(model->scenes, index);
}
const char* dpde_model_task(const dpde_model* model, size_t index) {
  return model == nullptr ? nullptr : host::name_in(model->tasks, index);
}
void dpde_model_free(dpde_model* model) { delete model; }
