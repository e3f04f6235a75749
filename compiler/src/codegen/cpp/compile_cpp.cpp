// SPDX-License-Identifier: Apache-2.0
// Source file -> shared library -> function pointers. The compiler gets its arguments as an array, without a shell. All
// files are in a private temporary folder (readable by this user alone), which is always removed.
#include "codegen/cpp/compile_cpp.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "codegen/cpp/abi_headers.h"
#include "codegen/cpp/emit_cpp.h"
#include "codegen/x86_names.h"
#include "support/process.h"

namespace dpde::codegen {

namespace {

namespace fs = std::filesystem;

/// Owns the handle of an open shared library.
class Library {
 public:
  explicit Library(const std::string& path) : handle_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {}
  Library(Library&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Library& operator=(Library&&) = delete;
  ~Library() {
    if (handle_) dlclose(handle_);
  }
  bool is_open() const { return handle_ != nullptr; }

  template <class Function>
  Function find(const std::string& symbol) const {
    return reinterpret_cast<Function>(dlsym(handle_, symbol.c_str()));
  }

 private:
  void* handle_;
};

class CppModule : public CompiledModule {
 public:
  CppModule(ProgramTables tables, Library library) : CompiledModule(std::move(tables)), library_(std::move(library)) {}

 private:
  Library library_;
};

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// $CXX may contain options ("ccache g++"). Words are separated by blanks, as in make.
std::vector<std::string> compiler_words(const std::string& compiler) {
  const char* from_environment = std::getenv("CXX");
  std::istringstream words(!compiler.empty()                       ? compiler
                           : from_environment && *from_environment ? from_environment
                                                                   : "c++");
  std::vector<std::string> result;
  for (std::string word; words >> word;) result.push_back(word);
  return result;
}

/// Runs the compiler; stdout and stderr go to `log`. Returns an error text if it did not start or did not succeed.
std::optional<std::string> run(const std::vector<std::string>& words, const fs::path& log) {
  const ProcessResult result = run_process(words, log);
  if (result.succeeded()) return std::nullopt;
  if (result.error != 0)
    return fmt::format("cannot start the C++ compiler {}: {}", words[0], std::strerror(result.error));
  return fmt::format("the C++ compiler {} failed:\n{}", words[0], read_text(log));
}

/// Use of full 512-bit vectors, and tuning for a processor that has them. A compiler older than the processor does not
/// recognise it and tunes for shorter vectors (measured with g++ 12: 1.2 to 1.6 times slower).
constexpr const char* vector_flags[] = {"-mprefer-vector-width=512", "-mtune=icelake-server"};

std::string host_march() {
#if defined(__x86_64__)
  if (const std::optional<InstructionSet> asked = asked_instruction_set()) return x86_name(*asked);
#endif
  return "native";
}

/// Output of --version, which distinguishes compiler releases; "" if the compiler has no such output.
std::string version_of(std::vector<std::string> compiler, const fs::path& log) {
  compiler.push_back("--version");
  return run(compiler, log) ? "" : read_text(log);
}

/// Compiler, flags and folder used to compile one module.
struct Build {
  std::vector<std::string> compiler, flags;
  std::string version;
  fs::path folder;

  fs::path library() const { return folder / "module.so"; }
  /// Cache key: everything that the library depends on.
  std::string key(const std::string& source) const {
    return fmt::format("library\n{}\n{}\n{}\n{}\n{}", fmt::join(compiler, " "), version, fmt::join(flags, " "),
                       abi_header_texts(), source);
  }
};

std::optional<std::string> write(const fs::path& path, const std::string& content) {
  std::ofstream out(path, std::ios::binary);
  out << content;
  if (out.flush()) return std::nullopt;
  return fmt::format("cannot write {}", path.string());
}

/// `compiler`: see compile_cpp.
Build build_with(const std::string& compiler, const fs::path& folder) {
  Build build{compiler_words(compiler), {}, "", folder};
  if (!build.compiler.empty()) build.version = version_of(build.compiler, folder / "log.txt");
  build.flags = cpp_flags(build.version.find("clang") != std::string::npos, host_march());
  return build;
}

std::optional<std::string> compile(const Build& build, const std::string& source) {
  if (build.compiler.empty()) return "no C++ compiler given";
  const fs::path file = build.folder / "module.cpp", log = build.folder / "log.txt";
  if (const auto error = write(file, source)) return error;
  if (!write_abi_headers(build.folder)) return fmt::format("cannot write {}", build.folder.string());
  std::vector<std::string> arguments = build.compiler;
  arguments.insert(arguments.end(), build.flags.begin(), build.flags.end());
  arguments.insert(arguments.end(),
                   {"-I", build.folder.string(), "-shared", "-o", build.library().string(), file.string()});
  const auto error = run(arguments, log);
  if (!error || read_text(log).find("-mprefer-vector-width") == std::string::npos) return error;
  for (const char* flag : vector_flags) std::erase(arguments, flag);  // this processor does not have these options
  return run(arguments, log);
}

CompileResult load(const loop::Module& module, const fs::path& path) {
  Library library(path.string());
  if (!library.is_open()) return {nullptr, false, fmt::format("cannot load the compiled module: {}", dlerror())};
  std::string missing;
  const auto require_symbol = [&](const std::string& symbol) {
    if (!library.find<void*>(symbol)) missing += " " + symbol;
  };
  require_symbol("dpde_compute_uniforms");
  if (!module.counters.empty()) require_symbol("dpde_compute_counted");
  for (const loop::Row& row : module.rows) require_symbol(symbol_of(row.name));
  if (!missing.empty()) return {nullptr, false, "the compiled module lacks" + missing};

  const RowResolver row_code = [&](const std::string& row) { return library.find<dpde_row_fn>(symbol_of(row)); };
  ProgramTables tables(module, row_code, library.find<ComputeUniforms>("dpde_compute_uniforms"),
                       library.find<ComputeUniforms>("dpde_compute_counted"));
  return {std::make_shared<CppModule>(std::move(tables), std::move(library)), false, ""};
}

}  // namespace

std::vector<std::string> cpp_flags(bool is_clang, const std::string& march) {
  // g++ needs twice the time to parse <math.h> in standards later than C++14.
  std::vector<std::string> flags{
      "-std=c++14",
      "-O3",
      "-march=" + march,
      is_clang ? "-ffp-contract=on"
               : "-ffp-contract=fast",  // with `fast`, clang ignores the marks of products that must not be contracted
      "-fno-math-errno",
      "-fno-trapping-math",
      "-fPIC",
      "-fopenmp-simd"};
  flags.insert(flags.end(), std::begin(vector_flags), std::end(vector_flags));
  // clang's load-PRE chains u[i - 1], u[i], u[i + 1] across iterations, which prevents vectorisation.
  if (is_clang) flags.insert(flags.end(), {"-mllvm", "-enable-load-pre=false"});
  return flags;
}

CompileResult compile_cpp_source(const loop::Module& module, const std::string& source, const std::string& compiler,
                                 CodeCache* cache) {
  const TemporaryFolder folder;
  if (folder.path().empty())
    return {nullptr, false, fmt::format("cannot make a temporary folder: {}", std::strerror(errno))};
  const Build build = build_with(compiler, folder.path());
  const bool may_keep = cache != nullptr && !build.version.empty();
  const std::string key = may_keep ? build.key(source) : "";
  if (const std::optional<std::string> kept = may_keep ? cache->find(key) : std::nullopt) {
    if (write(build.library(), *kept)) return {nullptr, false, "cannot write a temporary file"};
    CompileResult result = load(module, build.library());
    result.from_cache = result.module != nullptr;
    result.key = key;
    if (result.from_cache) return result;
    fs::remove(build.library());
  }
  if (const auto error = compile(build, source)) return {nullptr, false, *error};
  if (may_keep) cache->store(key, read_text(build.library()));
  CompileResult result = load(module, build.library());
  result.key = key;
  return result;
}

LibraryResult compile_cpp_library(const std::string& source, const std::string& soname, const std::string& march) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return {"", fmt::format("cannot make a temporary folder: {}", std::strerror(errno))};
  Build build = build_with("", folder.path());
  build.flags.insert(build.flags.end(), {"-Wl,-soname," + soname, "-march=" + march});
  if (const auto error = compile(build, source)) return {"", *error};
  return {read_text(build.library()), ""};
}

CompileResult compile_cpp(const loop::Module& module, const std::string& compiler, CodeCache* cache) {
  return compile_cpp_source(module, emit_cpp(module), compiler, cache);
}

}  // namespace dpde::codegen
