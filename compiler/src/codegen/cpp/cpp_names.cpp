// SPDX-License-Identifier: Apache-2.0
#include "codegen/cpp/cpp_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string_view>
#include <tuple>

#include "loop/expressions.h"

namespace dpde::codegen {

namespace {

/// Keywords that are possible DSL names, functions that the emitted code calls besides those of formulas, and variables
/// it declares.
constexpr auto reserved = std::to_array<std::string_view>({"alignas",
                                                           "alignof",
                                                           "and",
                                                           "and_eq",
                                                           "asm",
                                                           "auto",
                                                           "bitand",
                                                           "bitor",
                                                           "bool",
                                                           "break",
                                                           "case",
                                                           "catch",
                                                           "char",
                                                           "char16_t",
                                                           "char32_t",
                                                           "char8_t",
                                                           "class",
                                                           "compl",
                                                           "concept",
                                                           "const",
                                                           "const_cast",
                                                           "consteval",
                                                           "constexpr",
                                                           "constinit",
                                                           "continue",
                                                           "co_await",
                                                           "co_return",
                                                           "co_yield",
                                                           "decltype",
                                                           "default",
                                                           "delete",
                                                           "do",
                                                           "double",
                                                           "dynamic_cast",
                                                           "else",
                                                           "enum",
                                                           "explicit",
                                                           "export",
                                                           "extern",
                                                           "false",
                                                           "float",
                                                           "for",
                                                           "friend",
                                                           "goto",
                                                           "if",
                                                           "inline",
                                                           "int",
                                                           "long",
                                                           "mutable",
                                                           "namespace",
                                                           "new",
                                                           "noexcept",
                                                           "not",
                                                           "not_eq",
                                                           "nullptr",
                                                           "operator",
                                                           "or",
                                                           "or_eq",
                                                           "private",
                                                           "protected",
                                                           "public",
                                                           "register",
                                                           "requires",
                                                           "return",
                                                           "short",
                                                           "signed",
                                                           "sizeof",
                                                           "static",
                                                           "static_assert",
                                                           "static_cast",
                                                           "struct",
                                                           "switch",
                                                           "template",
                                                           "this",
                                                           "thread_local",
                                                           "throw",
                                                           "true",
                                                           "try",
                                                           "typedef",
                                                           "typeid",
                                                           "typename",
                                                           "union",
                                                           "unsigned",
                                                           "using",
                                                           "virtual",
                                                           "void",
                                                           "volatile",
                                                           "wchar_t",
                                                           "while",
                                                           "xor",
                                                           "xor_eq",
                                                           "reinterpret_cast",
                                                           "fabs",
                                                           "fabsf",
                                                           "pow",
                                                           "powf",
                                                           "signbit",
                                                           "isnan",
                                                           "isinf",
                                                           "isfinite",
                                                           "isnormal",
                                                           "fpclassify",
                                                           "int64_t",
                                                           "int32_t",
                                                           "uint64_t",
                                                           "i",
                                                           "row",
                                                           "count",
                                                           "first",
                                                           "params",
                                                           "uniforms",
                                                           "sums",
                                                           "unix",
                                                           "linux"});

/// sin, sinf, ...: formulas call them.
bool is_function_of_c(std::string_view name) {
  return find_fn(name) || (name.ends_with('f') && find_fn(name.substr(0, name.size() - 1)));
}

bool is_macro_like(const std::string& name) {  // M_PI, NAN, INFINITY: reserved for system headers
  return name.size() > 2 &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return std::islower(c) || c > 127; });
}

NameSupply row_words(const loop::Row& row) {
  NameSupply names;
  names.reserve(cpp_identifier(row.name) + "_cells");
  for (const char* word : {"cells_x", "cells_y", "cells_z", "stride_y", "stride_z", "place_y", "place_z"}) {
    names.reserve(word);
  }
  return names;
}

}  // namespace

std::string cpp_identifier(const std::string& name) {
  std::string result;
  for (const unsigned char c : name) result += std::isalnum(c) || c > 127 ? static_cast<char>(c) : '_';
  const bool is_reserved = std::ranges::find(reserved, result) != reserved.end() || is_function_of_c(result);
  if (is_reserved || is_macro_like(result) || result.starts_with("dpde_") || result.starts_with("__")) result += "_";
  return result;
}

std::string cpp_offset_suffix(const loop::Offset& offset, int rank) {
  std::string suffix;
  for (int axis = 0; axis < rank; ++axis) {
    const int k = offset[axis];
    suffix += k == 0 ? "_0" : fmt::format("_{}{}", k < 0 ? 'm' : 'p', k < 0 ? -k : k);
  }
  return suffix;
}

std::string cpp_stream_name(const loop::Stream& stream, int rank) {
  const std::string name = cpp_identifier(stream.field);
  return stream.offset == loop::Offset{} ? name : name + cpp_offset_suffix(stream.offset, rank);
}

CppNames cpp_names(const loop::Module& module, const loop::Row& row) {
  NameSupply supply = row_words(row);
  CppNames names;
  std::map<std::tuple<std::string, int, int>, std::string> shared;
  for (loop::Stream stream : row.streams) {
    if (stream.mode != loop::Stream::Mode::in) {
      names.streams.push_back(supply.fresh(cpp_stream_name(stream, row.rank)));
      continue;
    }
    std::string& name = shared[{stream.field, stream.offset[1], stream.offset[2]}];
    stream.offset[0] = 0;
    if (name.empty()) name = supply.fresh(cpp_stream_name(stream, row.rank));
    names.streams.push_back(name);
  }
  for (const std::string& grid : row.grids) names.grids.push_back(supply.fresh(cpp_identifier(grid) + "_grid"));
  for (const loop::Let& let : row.lets) names.lets.push_back(supply.fresh(cpp_identifier(let.name)));
  for (const loop::Sum& sum : row.sums) names.sums.push_back(supply.fresh(cpp_identifier(sum.name) + "_sum"));
  const std::set<int> used = loop::used_uniforms(row);
  for (std::size_t u = 0; u < module.uniforms.size(); ++u) {
    const bool is_used = used.contains(static_cast<int>(u));
    names.uniforms.push_back(is_used ? supply.fresh(cpp_identifier(module.uniforms[u].name)) : "");
  }
  return names;
}

CppUniformNames cpp_uniform_names(const loop::Module& module) {
  NameSupply supply;
  CppUniformNames names;
  for (const std::string& param : module.params) names.params.push_back(supply.fresh(cpp_identifier(param)));
  for (const std::string& counter : module.counters) names.counters.push_back(supply.fresh(cpp_identifier(counter)));
  for (const loop::UniformDef& uniform : module.uniforms) {
    const loop::Param* param = as<loop::Param>(uniform.value);
    const loop::Counter* counter = as<loop::Counter>(uniform.value);
    names.uniforms.push_back(param     ? names.params[param->index]
                             : counter ? names.counters[counter->index]
                                       : supply.fresh(cpp_identifier(uniform.name)));
  }
  return names;
}

}  // namespace dpde::codegen
