// SPDX-License-Identifier: Apache-2.0
// The header with the scene's class, and the CMake file. emit_tables.cpp has the source.
#include "codegen/cpp/emit_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <span>
#include <string_view>

#include "codegen/cpp/cpp_names.h"
#include "source/utf8.h"

namespace dpde::codegen {

namespace {

/// One member function of the class and its comment line.
struct Member {
  std::string name, declaration, comment;
};

/// `name` as part of a member's name. Keywords and macro-like names are allowed in that position; double underscores
/// are reserved and thus avoided.
std::string cpp_part(const std::string& name) {
  std::string part = cpp_identifier(name);
  while (part.size() > 1 && part.back() == '_' && name.back() != '_') part.pop_back();
  return part;
}

/// Adds a member. In `member` and `declaration`, {0} is `name` as a C++ identifier, {1} the name in the model.
void add(std::vector<Member>& members, const char* member, const char* declaration, const std::string& name,
         const std::string& comment = "") {
  const std::string word = cpp_part(name);
  members.push_back(
      {fmt::format(fmt::runtime(member), word), fmt::format(fmt::runtime(declaration), word, name), comment});
}

std::string states_text(const dpde_instants& at) {
  if (at.count == 0) return "one state";
  return at.count < 0 ? "every state, from the first to the last"
                      : fmt::format("{} states, one after the other", at.count);
}

void add_setters(std::vector<Member>& members, const dpde_scene& scene) {
  const std::span controls(scene.controls, static_cast<std::size_t>(scene.control_count));
  for (const dpde_value& param : std::span(scene.params, static_cast<std::size_t>(scene.param_count))) {
    const auto is_it = [&](const dpde_control& control) { return std::string_view(control.name) == param.name; };
    if (std::ranges::any_of(controls, is_it)) continue;
    add(members, "set_{}", "void set_{0}(double value) {{ set(\"{1}\", value); }}", param.name,
        fmt::format("Parameter {}, {} at first.", param.name, param.value));
    add(members, "get_{}", "double get_{0}() const {{ return param(\"{1}\"); }}", param.name);
  }
  for (const dpde_control& control : controls) {
    add(members, "set_control_{}", "void set_control_{0}(dpde::Values values) {{ set_control(\"{1}\", values); }}",
        control.name,
        fmt::format("Control {}: {} values, each for {} steps.", control.name, control.count, control.every));
  }
  for (int32_t s = 0; s < scene.program->swap_count; ++s) {
    const std::string name = scene.program->fields[scene.program->swaps[s].state];
    add(members, "set_{}", "void set_{0}(dpde::Values values) {{ set_state(\"{1}\", values); }}", name,
        fmt::format("Field {} at the present time.", name));
    add(members, "get_{}", "void get_{0}(dpde::Target to) const {{ state(\"{1}\", to); }}", name);
    add(members, "set_initial_{}", "void set_initial_{0}(dpde::Values values) {{ set_initial(\"{1}\", values); }}",
        name, "Where reset(), loss() and gradient() begin.");
  }
  for (const dpde_coefficient& c : std::span(scene.coefficients, static_cast<std::size_t>(scene.coefficient_count))) {
    const std::string intervals =
        c.every > 0 ? fmt::format(": {} fields, one after the other, each for {} steps", c.count, c.every) : "";
    add(members, "set_{}", "void set_{0}(dpde::Values values) {{ set_field(\"{1}\", values); }}", c.name,
        fmt::format("{} {}{}{}.", c.every > 0 ? "Control field" : "Coefficient", c.name,
                    c.has_formula ? "" : ", to be given", intervals));
  }
  for (const dpde_datum& d : std::span(scene.data, static_cast<std::size_t>(scene.datum_count))) {
    add(members, "set_{}", "void set_{0}(dpde::Values values) {{ set_field(\"{1}\", values); }}", d.name,
        fmt::format("Data of the task, to be given: {}.", states_text(d.at)));
  }
}

void add_results(std::vector<Member>& members, const dpde_scene& scene) {
  for (int32_t s = 0; scene.observe != nullptr && s < scene.observe->sum_count; ++s) {
    add(members, "observe_{}", "double observe_{0}() {{ return observe(\"{1}\"); }}", scene.observe->sums[s]);
  }
  for (const dpde_unknown& u : std::span(scene.unknowns, static_cast<std::size_t>(scene.unknown_count))) {
    const bool is_param = u.kind == DPDE_UNKNOWN_PARAM, is_initial = u.kind == DPDE_UNKNOWN_INITIAL;
    add(members, "{}_bar",
        is_param ? "double {0}_bar() const {{ return gradient_of(\"{1}\")[0]; }}"
                 : "std::span<const double> {0}_bar() const {{ return gradient_of(\"{1}\"); }}",
        u.name, fmt::format("d loss / d {}{}, of the last gradient().", is_initial ? "initial " : "", u.name));
  }
}

std::vector<Member> members_of(const dpde_scene& scene) {
  std::vector<Member> members;
  add_setters(members, scene);
  add_results(members, scene);
  return members;
}

std::string cells_text(const dpde_scene& scene) {
  std::string text;
  for (int32_t a = 0; a < scene.rank; ++a) text += fmt::format("{}{}", a == 0 ? "" : " x ", scene.axes[a].cells);
  return text;
}

}  // namespace

std::string generated_mark() { return "Generated by dpde"; }

std::string library_name_clash(const dpde_scene& scene, const std::string& name) {
  const bool is_identifier = !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) == 0;
  const bool is_of_others = name == "dpde" || name == "std";  // namespaces used in its header
  if (!is_identifier || is_of_others || cpp_identifier(name) != name)
    return fmt::format("{} cannot be the name of a C++ class", name);
  std::set<std::string> taken{name,           "params",
                              "states",       "unknowns",
                              "cells",        "size",
                              "coordinates",  "set",
                              "param",        "set_state",
                              "set_initial",  "set_field",
                              "set_control",  "control",
                              "state",        "initial",
                              "observe",      "time",
                              "time_step",    "steps_done",
                              "reset",        "step",
                              "run_to",       "run",
                              "loss",         "gradient",
                              "gradient_of",  "gradient_vector",
                              "value_of",     "unknown_values",
                              "set_unknowns", "hessian_vector",
                              "optimise",     "watch_gradients",
                              "fields",       "field_size",
                              "is_number",    "unit"};
  for (const Member& member : members_of(scene)) {
    if (!taken.insert(member.name).second)
      return fmt::format("class {} would have two members called {}", name, member.name);
  }
  return "";
}

std::string emit_library_header(const dpde_scene& scene, const std::string& name, const SourceFile& source) {
  const std::string what =
      scene.task ? fmt::format("task {} of scene {}", scene.task, scene.name) : fmt::format("scene {}", scene.name);
  std::string out = fmt::format("// {} from {}: {}, {} cells, {} steps.\n", generated_mark(),
                                printable_line(source.path()), what, cells_text(scene), scene.steps);
  out +=
      "// What the class can do beside this is in dpde/runtime/simulation.h: step, run_to, run, loss, gradient, "
      "optimise.\n";
  out += "#pragma once\n\n#include <dpde/runtime/simulation.h>\n\n";
  out += fmt::format("extern \"C\" const dpde_scene {}_scene;\n\n", name);
  out += fmt::format("class {} : public dpde::Simulation {{\n public:\n", name);
  out += fmt::format(
      "  explicit {0}(const dpde::SimulationOptions& options = {{}}) : Simulation({0}_scene, options) {{}}\n", name);
  for (const Member& member : members_of(scene)) {
    if (!member.comment.empty()) out += fmt::format("\n  /// {}\n", member.comment);
    out += fmt::format("  {}\n", member.declaration);
  }
  return out + "};\n";
}

std::string emit_library_cmake(const std::string& name) {
  return fmt::format(R"(# {1}: include() this file and link {0}.
if(NOT TARGET dpde::runtime)
  find_package(dpde REQUIRED)
endif()
add_library({0} SHARED IMPORTED)
set_target_properties({0} PROPERTIES IMPORTED_LOCATION "${{CMAKE_CURRENT_LIST_DIR}}/lib{0}.so" IMPORTED_SONAME lib{0}.so)
target_include_directories({0} INTERFACE "${{CMAKE_CURRENT_LIST_DIR}}")
target_link_libraries({0} INTERFACE dpde::runtime)
)",
                     name, generated_mark());
}

}  // namespace dpde::codegen
