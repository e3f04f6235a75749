// SPDX-License-Identifier: Apache-2.0
// For a function declared with attribute simd, g++ calls the vector function _ZGV<processor>N<lanes><v for each
// argument>_<function>. If it sees the scalar definition, it generates the vector functions itself, but does not
// vectorise those that may call the C library. So the scalar function is only declared, and the vector functions are
// defined here. All are local to the file.
#include "codegen/cpp/cpp_elementary.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <set>
#include <string_view>

#include "codegen/cpp/cpp_expression.h"
#include "codegen/elementary_functions.h"
#include "loop/expressions.h"

namespace dpde::codegen {

namespace {

/// Letters of the x86 vector ABI, for registers of 16, 32, 32 and 64 bytes.
struct Registers {
  char letter;
  int bytes;
  std::string_view needs;
};
constexpr std::array<Registers, 4> registers{
    {{'b', 16, "__SSE2__"}, {'c', 32, "__AVX__"}, {'d', 32, "__AVX2__"}, {'e', 64, "__AVX512F__"}}};

std::set<std::string> functions_of(const loop::Module& module) {
  std::set<std::string> names;
  const auto look = [&](const loop::Expr& e) {
    const loop::Call* call = as<loop::Call>(e);
    if (call && is_elementary(call->fn)) names.insert(std::string(name_of(call->fn)));
    const loop::Binary* binary = as<loop::Binary>(e);
    if (binary && binary->op == BinaryOp::power && !is_small_power(*binary)) names.insert("pow");
  };
  for (const loop::Row& row : module.rows) visit(row, look);
  return names;
}

/// Text of one elementary function.
struct Function {
  std::string name, real, formula;  // e.g. dpde_sinf, float, dpde::elementary::Sin
  bool is_binary;

  std::string parameters(const std::string& type) const {
    return is_binary ? fmt::format("{0} x, {0} y", type) : type + " x";
  }
  std::string arguments() const { return is_binary ? "x, y" : "x"; }
  std::string vectors(const Registers& in) const;
  std::string scalar(const std::string& head) const {
    return fmt::format("{}({}) {{ return dpde::elementary::one<{}>({}); }}\n", head, parameters(real), formula,
                       arguments());
  }
  std::string for_gcc() const;
};

std::string Function::vectors(const Registers& in) const {
  const int count = in.bytes / (real == "float" ? 4 : 8);
  const std::string vector = fmt::format("dpde::elementary::{}{}", real, count);
  const std::string head = fmt::format("static {} {}_{}({})", vector, name, in.letter, parameters(vector));
  const std::string symbol = fmt::format("_ZGV{}N{}{}_{}", in.letter, count, is_binary ? "vv" : "v", name);
  return fmt::format("#ifdef {}\n{} __asm__(\"{}\") __attribute__((used));\n", in.needs, head, symbol) +
         fmt::format("{} {{ return dpde::elementary::several<{}, {}, {}>({}); }}\n#endif\n", head, formula, real, count,
                     arguments());
}

std::string Function::for_gcc() const {
  std::string out = fmt::format(
      "extern \"C\" {} {}({}) __attribute__((simd(\"notinbranch\"), const, nothrow, visibility(\"hidden\")));\n", real,
      name, parameters(real));
  out += fmt::format("static {0} {1}_1({2}) __asm__(\"{1}\") __attribute__((used));\n", real, name, parameters(real));
  out += scalar(fmt::format("static {} {}_1", real, name));
  for (const Registers& r : registers) out += vectors(r);
  return out;
}

Function function(const std::string& name, Precision real) {
  std::string formula = "dpde::elementary::" + name;
  formula[formula.size() - name.size()] = static_cast<char>(std::toupper(name[0]));
  return {cpp_elementary_prefix() + name + (real == Precision::f32 ? "f" : ""), std::string(cpp_real(real)), formula,
          name == "pow"};
}

}  // namespace

std::string cpp_elementary_prefix() { return "dpde_"; }

std::string cpp_elementary(const loop::Module& module) {
  std::string for_gcc, for_others;
  for (const std::string& name : functions_of(module)) {
    const Function f = function(name, module.real);
    for_gcc += f.for_gcc();
    for_others += f.scalar(fmt::format("static inline {} {}", f.real, f.name));
  }
  if (for_gcc.empty()) return "";
  return "\n// Functions of cells; those with _ZGV are what g++ calls for several cells at once. It decides to after "
         "link-time optimisation has\n"
         "// dropped what nothing calls by name: compile this file with -fno-lto, also where the rest of the program "
         "is linked with -flto.\n"
         "#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__ELF__)\n" +
         for_gcc + "#else\n" + for_others + "#endif\n";
}

}  // namespace dpde::codegen
