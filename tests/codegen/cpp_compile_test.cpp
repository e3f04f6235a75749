// SPDX-License-Identifier: Apache-2.0
// The way from text to loaded code: failures are texts, nothing stays behind, and the loops become vector instructions.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "codegen/cpp/compile_cpp.h"
#include "codegen/cpp/emit_cpp.h"
#include "loop/from_stencil.h"
#include "loop/loop_samples.h"

namespace dpde::codegen {
namespace {

using namespace samples;  // NOLINT
namespace fs = std::filesystem;

loop::Module lowered_burgers() { return loop::from_stencil(burgers(), {"burgers_step"}); }

/// An empty folder that temporary files go to during a test.
class CppCompile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("dpde_cpp_compile_test_" + std::to_string(getpid()));
    fs::create_directory(folder_);
    setenv("TMPDIR", folder_.c_str(), 1);
  }
  void TearDown() override {
    EXPECT_TRUE(fs::is_empty(folder_));
    unsetenv("TMPDIR");
    fs::remove_all(folder_);
  }
  fs::path folder_;
};

TEST_F(CppCompile, LeavesNoFiles) {
  const CompileResult result = compile_cpp(lowered_burgers());
  EXPECT_EQ(result.error, "");
  ASSERT_NE(result.module, nullptr);
  EXPECT_EQ(result.module->names(), std::vector<std::string>{"burgers_step"});
  EXPECT_EQ(result.module->find("other"), nullptr);
  ASSERT_EQ(result.module->find("burgers_step")->kernel_count, 1);
  EXPECT_NE(result.module->find("burgers_step")->kernels[0].row, nullptr);
}

TEST_F(CppCompile, ErrorsOfTheCompilerAreReported) {
  const CompileResult result = compile_cpp_source(lowered_burgers(), "int main( {", "g++");
  EXPECT_EQ(result.module, nullptr);
  EXPECT_TRUE(result.error.starts_with("the C++ compiler g++ failed:\n")) << result.error;
  EXPECT_NE(result.error.find("module.cpp:1"), std::string::npos) << result.error;
}

/// By hand: with what changes sums and hides NaN the file does not compile.
TEST_F(CppCompile, RefusesFastMath) {
  const fs::path source = folder_ / "module.cpp", object = folder_ / "module.o", log = folder_ / "log";
  std::ofstream(source) << emit_cpp(lowered_burgers());
  const auto compiles = [&](const std::string& flags) {
    const std::string command = "g++ -std=c++20 -c " + flags + " -I" + DPDE_SOURCE_DIR + "/runtime/abi " +
                                source.string() + " -o " + object.string() + " 2> " + log.string();
    return std::system(command.c_str()) == 0;
  };
  EXPECT_TRUE(compiles("-O2"));
  for (const char* flags : {"-ffast-math", "-Ofast", "-ffinite-math-only"}) {
    EXPECT_FALSE(compiles(flags)) << flags;
    std::ifstream told(log);
    const std::string text{std::istreambuf_iterator<char>(told), {}};
    EXPECT_NE(text.find("compile this file without -ffast-math"), std::string::npos) << text;
  }
  for (const fs::path& path : {source, object, log}) fs::remove(path);
}

TEST_F(CppCompile, MissingCompiler) {
  const CompileResult result = compile_cpp(lowered_burgers(), "no-such-compiler");
  EXPECT_EQ(result.module, nullptr);
  EXPECT_EQ(result.error, "cannot start the C++ compiler no-such-compiler: No such file or directory");
}

TEST_F(CppCompile, TheShellIsNotAsked) {
  const fs::path victim = folder_.string() + "_victim";
  const CompileResult result = compile_cpp(lowered_burgers(), "true; touch " + victim.string() + " #");
  EXPECT_EQ(result.module, nullptr);
  EXPECT_FALSE(fs::exists(victim));
}

TEST_F(CppCompile, MissingFunctionsAreReported) {
  const CompileResult result = compile_cpp_source(lowered_burgers(), "extern \"C\" void dpde_compute_uniforms() {}\n");
  EXPECT_EQ(result.module, nullptr);
  EXPECT_EQ(result.error, "the compiled module lacks burgers_step_row");
}

// ---- vector instructions -------------------------------------------------------------------------------------------

stencil::Module samples_to_vectorise() {
  stencil::Module module = burgers();
  const stencil::Module heat = heat_2d();
  const Expr u = access("u"), east = access("u", {1, 0}), west = access("u", {-1, 0});
  Kernel masked{.name = "masked", .rank = 2};
  const auto term = [&](Offset k) { return select(inside(k, 0), access("u", k) * access("w", k), 0.0); };
  masked.stores = {{"v", false, term({-1, 0}) + term({1, 0}) + term({0, 1}) + term({0, -1}), {}}};
  Kernel upwind{.name = "upwind", .rank = 2};
  upwind.stores = {{"v", true, call(Fn::max, {u, 0.0}) * (u - west) + call(Fn::min, {u, 0.0}) * (east - u), {}},
                   {"w", false, select(binary(BinaryOp::less, u, east), power(u - west, 3), call(Fn::sqrt, {u})), {}}};
  Kernel choice{.name = "choice", .rank = 2};
  const Expr between = binary(BinaryOp::logical_and, binary(BinaryOp::less, west, u), binary(BinaryOp::less, u, east));
  const Expr outside = binary(BinaryOp::logical_or, binary(BinaryOp::less, u, 0.0), binary(BinaryOp::less, 1.0, u));
  choice.stores = {{"v", false, select(between, access("w", {1, 0}) * u, 0.0) + select(outside, east - west, u), {}}};
  Kernel loss{.name = "loss", .rank = 2, .sums = {{"loss", power(u - east, 2)}, {"mass", u}}};
  Kernel places{.name = "places", .rank = 2};
  places.stores = {{"v", false, interp({"q", {}, {u, access("w")}, {}}), {}}};
  module.kernels.insert(module.kernels.end(), {heat.kernels[0], masked, upwind, choice, loss, places});
  Program all{.name = "all", .axes = {Topology::bounded, Topology::bounded}};
  all.body = {run("heat_step"), run("masked"), run("upwind"), run("choice"), run("loss"), run("places")};
  Program wrapped{.name = "wrapped", .axes = {Topology::periodic, Topology::periodic}, .body = {run("places")}};
  module.programs.insert(module.programs.end(), {all, wrapped});
  return module;
}

/// As the text says: its functions of vectors are called by name only after link-time optimisation.
TEST_F(CppCompile, LinksIntoWhatIsOptimisedAtLinkTime) {
  stencil::Module module = burgers();
  module.kernels.push_back({.name = "waves", .rank = 1, .stores = {{"v", false, call(Fn::sin, {access("u")}), {}}}});
  module.programs.push_back({.name = "waves", .axes = {Topology::periodic}, .body = {run("waves")}});
  const std::string text = emit_cpp(loop::from_stencil(module, {"waves"}));
  ASSERT_NE(text.find("compile this file with -fno-lto"), std::string::npos);
  const fs::path source = folder_ / "module.cpp", object = folder_ / "module.o", library = folder_ / "module.so",
                 log = folder_ / "log";
  std::ofstream(source) << text;
  const std::string flags = std::string("-std=c++20 -O2 -fopenmp-simd -fno-math-errno -fPIC -flto -fno-lto -I") +
                            DPDE_SOURCE_DIR + "/runtime/abi ";
  const std::string to_log = " > " + log.string() + " 2>&1";
  EXPECT_EQ(std::system(("g++ " + flags + "-c " + source.string() + " -o " + object.string() + to_log).c_str()), 0);
  EXPECT_EQ(std::system(("g++ -O2 -flto -shared " + object.string() + " -o " + library.string() + to_log).c_str()), 0);
  for (const fs::path& path : {source, object, library, log}) fs::remove(path);
}

/// What the compiler says about vectorised loops: lines "FILE:LINE:...".
std::string remarks(const std::string& compiler, const std::string& march, const std::string& flag,
                    const fs::path& source) {
  std::string command = compiler;
  for (const std::string& word : cpp_flags(compiler == "clang++", march)) command += " " + word;
  command += " -I" DPDE_SOURCE_DIR "/runtime/abi";
  command += " " + flag + " -c -o /dev/null " + source.string() + " 2>&1";
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  for (char line[512]; fgets(line, sizeof line, pipe);) text += line;
  EXPECT_EQ(pclose(pipe), 0) << text;
  return text;
}

int line_at(const std::string& text, std::size_t place) {
  return static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n')) + 1;
}

/// Whether `words` stand behind `start` in some line of `text`.
bool says(const std::string& text, const std::string& start, const std::string& words) {
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1)) {
    if (text.substr(at, text.find('\n', at) - at).find(words) != std::string::npos) return true;
  }
  return false;
}

constexpr const char *with_avx2 = "x86-64-v3", *with_avx512 = "x86-64-v4";

/// Of processors by name, so that it says the same wherever it runs. Computed places turn doubles to whole numbers of
/// 64 bits, of which only AVX-512 does several at once.
void expect_all_loops_vectorise(const std::string& compiler, const std::string& march, const std::string& flag,
                                const std::string& remark, Precision real) {
  if (std::system(("command -v " + compiler + " > /dev/null").c_str()) != 0) {
    std::printf("%s is not installed: its remarks are not looked at\n", compiler.c_str());
    return;
  }
  const std::string text =
      emit_cpp(loop::from_stencil(samples_to_vectorise(), {"burgers_step", "all", "wrapped"}, real));
  const fs::path source = fs::temp_directory_path() / ("dpde_vectorise_" + compiler + std::string(name_of(real)) +
                                                       std::to_string(getpid()) + ".cpp");
  std::ofstream(source) << text;
  const std::string said = remarks(compiler, march, flag, source);
  fs::remove(source);

  // Compilers name some line of the function.
  int loops = 0;
  for (std::size_t start = text.find("_cells("); start != std::string::npos;
       start = text.find("\nstatic void ", start + 1)) {
    ++loops;
    const bool reads_places =
        text.substr(start, text.find("\n}\n", start) - start).find("dpde_interp") != std::string::npos;
    if (reads_places && march != with_avx512) continue;
    const std::size_t first = text.rfind('\n', text.find("_cells(", start)) + 1;
    const int first_line = line_at(text, first), last_line = line_at(text, text.find("\n}\n", first));
    bool found = false;
    for (int line = first_line; line <= last_line; ++line) {
      found = found || says(said, source.filename().string() + ":" + std::to_string(line) + ":", remark);
    }
    EXPECT_TRUE(found) << compiler << ": the loop at line " << first_line << " is not vectorised\n" << text << said;
  }
  EXPECT_EQ(loops, 8);
}

TEST(CppVectorise, Gcc) {
  for (const char* march : {with_avx2, with_avx512}) {
    for (const Precision real : {Precision::f64, Precision::f32})
      expect_all_loops_vectorise("g++", march, "-fopt-info-vec", "loop vectorized", real);
  }
}
TEST(CppVectorise, Clang) {
  for (const char* march : {with_avx2, with_avx512}) {
    for (const Precision real : {Precision::f64, Precision::f32})
      expect_all_loops_vectorise("clang++", march, "-Rpass=loop-vectorize", "vectorized loop", real);
  }
}

/// Every function and helper there is; sums aside, whose terms are cast, a float must never meet a double.
TEST(CppSinglePrecision, IsNeverPromoted) {
  stencil::Module module = samples_to_vectorise();
  const Expr u = access("u");
  Kernel functions{.name = "functions", .rank = 2};
  Expr total = power(u, 0.3) + 0.1;
  for (int kind = 0; kind < along_count; ++kind) {
    total =
        total +
        interp({"q",
                {},
                {u, access("w")},
                {static_cast<InterpolationBasis>(kind), static_cast<InterpolationBasis>((kind + 1) % along_count)}});
  }
  for (int fn = 0; fn <= static_cast<int>(Fn::max); ++fn) {
    total = total +
            (arity(static_cast<Fn>(fn)) == 2 ? call(static_cast<Fn>(fn), {u, 0.7}) : call(static_cast<Fn>(fn), {u}));
  }
  functions.stores = {{"v", false, total, {}}};
  functions.scatters = {{{"r", {}, {u, access("w")}, {}}, u}};
  module.kernels.push_back(functions);
  for (const Topology kind : {Topology::periodic, Topology::bounded}) {
    const std::string name = kind == Topology::periodic ? "p" : "b";
    module.programs.push_back(Program{.name = name, .axes = {kind, kind}, .body = {run("functions")}});
  }
  const loop::Module loops = loop::from_stencil(module, {"burgers_step", "all", "wrapped", "p", "b"}, Precision::f32);
  const CompileResult result = compile_cpp(loops, "g++ -Wdouble-promotion -Wfloat-conversion -Werror");
  EXPECT_TRUE(result.module) << result.error;
  const std::string text = emit_cpp(loops);
  EXPECT_NE(text.find("sinf("), std::string::npos);
  EXPECT_NE(text.find("floorf("), std::string::npos);
  EXPECT_NE(text.find("loss_sum += (double)("), std::string::npos);
}

}  // namespace
}  // namespace dpde::codegen
