// SPDX-License-Identifier: Apache-2.0
// Source file -> shared library -> function pointers. Nothing passes through a shell: the compiler gets its arguments
// as an array. Everything lives in a folder of its own that only this user can read and that is removed in any case.
#include "codegen/cpp/compile_cpp.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

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

namespace dpde::codegen {

namespace {

namespace fs = std::filesystem;

/// A folder that is gone at the end of its scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    const fs::path base = fs::temp_directory_path(error);
    std::string name = ((error ? fs::path("/tmp") : base) / "dpde-XXXXXX").string();
    if (mkdtemp(name.data())) path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  /// Empty when the folder could not be made.
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// An open shared library.
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
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// $CXX may hold options ("ccache g++"): words are separated by blanks, as make does it.
std::vector<std::string> compiler_words(const std::string& compiler) {
  const char* from_environment = std::getenv("CXX");
  std::istringstream words(!compiler.empty()                       ? compiler
                           : from_environment && *from_environment ? from_environment
                                                                   : "c++");
  std::vector<std::string> result;
  for (std::string word; words >> word;) result.push_back(word);
  return result;
}

/// Runs a program with both outputs in `log`; an error text when it did not start or did not succeed.
std::optional<std::string> run(std::vector<std::string> words, const fs::path& log) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failure = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) return fmt::format("cannot start the C++ compiler {}: {}", words[0], std::strerror(failure));

  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return fmt::format("cannot wait for the C++ compiler: {}", std::strerror(errno));
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::nullopt;
  return fmt::format("the C++ compiler {} failed:\n{}", words[0], read_text(log));
}

/// Whole 512-bit vectors; and the tuning of a processor that has them, since compilers older than the processor they run
/// on take it for one that has not (measured with g++ 12: 1.2 to 1.6 times).
constexpr const char* vector_flags[] = {"-mprefer-vector-width=512", "-mtune=icelake-server"};

bool is_clang(std::vector<std::string> compiler, const fs::path& log) {
  compiler.push_back("--version");
  return !run(compiler, log) && read_text(log).find("clang") != std::string::npos;
}

/// Builds the library and opens it; the file may go afterwards.
/// `more` are further options.
std::optional<std::string> build(const std::string& source, const std::string& compiler, const fs::path& folder,
                                 const std::vector<std::string>& more = {}) {
  const std::vector<std::string> words = compiler_words(compiler);
  if (words.empty()) return "no C++ compiler given";
  const fs::path file = folder / "module.cpp";
  {
    std::ofstream out(file);
    out << source;
    if (!out.flush() || !write_abi_headers(folder)) return fmt::format("cannot write {}", file.string());
  }
  const fs::path log = folder / "log.txt";
  std::vector<std::string> arguments = words;
  for (const std::string& flag : cpp_flags(is_clang(words, log))) arguments.push_back(flag);
  arguments.insert(arguments.end(), {"-I", folder.string(), "-shared", "-o", (folder / "module.so").string(), file.string()});
  arguments.insert(arguments.end(), more.begin(), more.end());
  const auto error = run(arguments, log);
  if (!error || read_text(log).find("-mprefer-vector-width") == std::string::npos) return error;
  for (const char* flag : vector_flags) std::erase(arguments, flag);  // not options on this processor
  return run(arguments, log);
}

CompileResult load(const loop::Module& module, const fs::path& path) {
  Library library(path.string());
  if (!library.is_open()) return {nullptr, fmt::format("cannot load the compiled module: {}", dlerror())};
  std::string missing;
  const auto require_symbol = [&](const std::string& symbol) {
    if (!library.find<void*>(symbol)) missing += " " + symbol;
  };
  require_symbol("dpde_compute_uniforms");
  for (const loop::Row& row : module.rows) require_symbol(symbol_of(row.name));
  if (!missing.empty()) return {nullptr, "the compiled module lacks" + missing};

  const RowResolver row_code = [&](const std::string& row) { return library.find<dpde_row_fn>(symbol_of(row)); };
  ProgramTables tables(module, row_code, library.find<ComputeUniforms>("dpde_compute_uniforms"));
  return {std::make_shared<CppModule>(std::move(tables), std::move(library)), ""};
}

}  // namespace

std::vector<std::string> cpp_flags(bool is_clang) {
  // C++14: <math.h> of later standards takes g++ twice the time.
  std::vector<std::string> flags{"-std=c++14",
          "-O3",
          "-march=native",
          "-ffp-contract=fast",
          "-fno-math-errno",
          "-fno-trapping-math",
          "-fPIC",
          "-fopenmp-simd"};
  flags.insert(flags.end(), std::begin(vector_flags), std::end(vector_flags));
  // Its load-PRE chains u[i - 1], u[i], u[i + 1] through the loop, which then stays scalar.
  if (is_clang) flags.insert(flags.end(), {"-mllvm", "-enable-load-pre=false"});
  return flags;
}

CompileResult compile_cpp_source(const loop::Module& module, const std::string& source, const std::string& compiler) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return {nullptr, fmt::format("cannot make a temporary folder: {}", std::strerror(errno))};
  if (const auto error = build(source, compiler, folder.path())) return {nullptr, *error};
  return load(module, folder.path() / "module.so");
}

LibraryResult compile_cpp_library(const std::string& source, const std::string& soname, const std::string& march) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return {"", fmt::format("cannot make a temporary folder: {}", std::strerror(errno))};
  if (const auto error = build(source, "", folder.path(), {"-Wl,-soname," + soname, "-march=" + march})) return {"", *error};
  return {read_text(folder.path() / "module.so"), ""};
}

CompileResult compile_cpp(const loop::Module& module, const std::string& compiler) {
  return compile_cpp_source(module, emit_cpp(module), compiler);
}

}  // namespace dpde::codegen
