// SPDX-License-Identifier: Apache-2.0
// The rule of the house that a class can be read on one page: the data members of each are few.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path source_root = DPDE_SOURCE_DIR;
constexpr int most_members = 15;

/// What had more when the rule came, and how many it has: a number may become smaller and none may be added.
const std::map<std::string, int> larger{
    {"compiler/src/adjoint/reverse/reversal.h Reversal", 19},
    {"compiler/src/analysis/certificate/certificate.h Certificate", 18},
    {"compiler/src/analysis/certificate/program_check.h ProgramCheck", 16},
    {"compiler/src/chart/budget.cpp Companions", 16},
    {"compiler/src/codegen/llvm/emit_row.cpp RowEmitter", 20},
    {"compiler/src/codegen/program_table.cpp ProgramTables::Table", 22},
    {"compiler/src/driver/compile/pipeline.h CompileOptions", 17},
    {"compiler/src/driver/compile/pipeline.h Compiled", 16},
    {"compiler/src/driver/scene/scene_table.cpp SceneTable::Storage", 19},
    {"compiler/src/files/trajectories.h Trajectories", 16},
    {"compiler/src/model/model.h Problem", 27},
    {"compiler/src/network/network.h Layer", 16},
    {"compiler/src/stability/step_limit.h FrozenAnalysis", 19},
    {"compiler/src/stability/stability_report.h StabilityReport", 30},
    {"compiler/src/stencil/lower/from_model.h ProgramNames", 18},
    {"compiler/src/stencil/lower/iterations.h IterationFields", 25},
    {"compiler/src/stencil/analyse/verify_stencil.cpp ProgramCheck", 17},
    {"compiler/src/support/maths/jump_search.h JumpSearch", 17},
    {"compiler/src/syntax/expand/repeats.cpp ProgramResolver", 16},
    {"compiler/src/training/trainer.h Trainer", 21},
    {"compiler/src/training/tests/trajectory_test.h TrajectoryTest", 17},
    {"runtime/include/dpde/runtime/engine.h Engine", 28},
    {"runtime/include/dpde/runtime/rollout.h RolloutSetup", 33},
    {"runtime/src/exec/field_solve.h FieldSolve", 17},
    {"runtime/src/network/engine.h Engine", 27},
    {"runtime/src/network/kernels/kernels.h ConvolveCall", 20},
    {"runtime/src/exec/newton_solve.h NewtonSolve", 21},
    {"runtime/src/solve/multigrid/cycle_level.h CycleLevel", 24},
    {"runtime/src/solve/operator/gmres.h Gmres", 19},
    {"runtime/src/solve/operator/krylov.h Iterations", 18},
    {"runtime/src/solve/solver/linear_solver_impl.h LinearSolver::Impl", 24},
    {"runtime/src/exec/sweep.h Sweep", 17},
    {"runtime/src/wavefront/wavefront_impl.h Wavefront::Impl", 22},
};

std::string read(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Where what begins at `at` ends that is no code: a comment, a line of the preprocessor, or what stands in quotes;
/// `at` where code is.
std::size_t end_of_text(const std::string& text, std::size_t at) {
  const auto behind = [&](const std::string& end) {
    const std::size_t found = text.find(end, at + 2);
    return found == std::string::npos ? text.size() : found + end.size();
  };
  const std::size_t line = text.find_last_not_of(" \t", at == 0 ? 0 : at - 1);
  if (text[at] == '#' && (at == 0 || text[line] == '\n')) return std::min(text.find('\n', at), text.size());
  if (text.compare(at, 2, "//") == 0) return std::min(text.find('\n', at), text.size());
  if (text.compare(at, 2, "/*") == 0) return behind("*/");
  if (text.compare(at, 2, "R\"") == 0) {
    const std::size_t open = text.find('(', at);
    return behind(")" + text.substr(at + 2, open - at - 2) + "\"");
  }
  const bool separates_digits = at > 0 && std::isalnum(static_cast<unsigned char>(text[at - 1]));
  if (text[at] != '"' && (text[at] != '\'' || separates_digits)) return at;
  std::size_t end = at + 1;
  while (end < text.size() && text[end] != text[at]) end += text[end] == '\\' ? 2 : 1;
  return std::min(end + 1, text.size());
}

std::string code_of(const std::string& text) {
  std::string code;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = end_of_text(text, at);
    if (end == at) code += text[at++];
    at = end > at ? end : at;
  }
  return code;
}

/// Data members of the classes of a file, by their names: "Rollout::Impl".
class Members {
 public:
  explicit Members(const std::string& code) : code_(code) { read_scope("", nullptr); }
  const std::map<std::string, int>& counts() const { return counts_; }

 private:
  /// Declarations up to the brace that ends them. `members`: of the class whose they are, null outside of classes.
  void read_scope(const std::string& name, int* members) {
    std::string head;
    for (; at_ < code_.size() && code_[at_] != '}'; ++at_) {
      if (code_[at_] == ';') {
        if (members != nullptr) *members += declared_by(head);
        head.clear();
      } else if (code_[at_] == '{') {
        read_braces(head, name);
      } else if (code_[at_] == ':' && is_access(head)) {
        head.clear();
      } else {
        head += code_[at_];
      }
    }
  }

  /// A class, a namespace, or what is of no interest: the body of a function, an initialiser, an enumeration.
  void read_braces(std::string& head, const std::string& outer) {
    static const std::regex a_class(
        R"re(^\s*(template\s*<[^]*>\s*)?(class|struct|union)(\s+([A-Za-z_:0-9]+))?[^()=]*$)re"),
        an_enumeration(R"re(^\s*enum\b)re"), a_namespace(R"re(^\s*(inline\s+)?namespace\b[^]*|^\s*extern\s*$)re");
    std::smatch match;
    ++at_;
    if (std::regex_match(head, match, a_class)) {
      const std::string name = outer + (outer.empty() ? "" : "::") + match[4].str();
      int own = 0;
      read_scope(name, &own);
      int& most = counts_[name];
      most = std::max(most, own);
      head = "of_class ";  // an object may follow
    } else if (std::regex_match(head, a_namespace)) {
      read_scope("", nullptr);
      head.clear();
    } else {
      skip_braces();
      if (std::regex_search(head, an_enumeration)) head = "of_class ";
      if (is_function(head) && !goes_on()) head.clear();
    }
  }

  void skip_braces() {
    for (int depth = 1; at_ < code_.size(); ++at_) {
      depth += code_[at_] == '{' ? 1 : code_[at_] == '}' ? -1 : 0;
      if (depth == 0) return;
    }
  }

  /// Behind the initialiser of one member in the head of a constructor come others, or its body; behind that of a
  /// parameter the rest of the head.
  bool goes_on() const {
    const std::size_t next = code_.find_first_not_of(" \t\n", at_ + 1);
    return next != std::string::npos && (code_[next] == ',' || code_[next] == '{' || code_[next] == ')');
  }

  static bool is_access(const std::string& head) {
    static const std::regex access(R"re(^\s*(public|private|protected)\s*$)re");
    return std::regex_match(head, access);
  }

  /// Without what is in angle brackets, of templates.
  static std::string without_templates(const std::string& head) {
    std::string result;
    int depth = 0;
    for (std::size_t i = 0; i < head.size(); ++i) {
      const bool opens = head[i] == '<' && i > 0 && std::isalnum(static_cast<unsigned char>(head[i - 1]));
      if (opens) ++depth;
      if (depth == 0) result += head[i];
      if (depth > 0 && head[i] == '>') --depth;
    }
    return result;
  }

  static bool is_function(const std::string& head) {
    const std::string plain = without_templates(head);
    return plain.find('(') < plain.find('=') || plain.find("operator") != std::string::npos;
  }

  /// How many members it declares.
  static int declared_by(const std::string& head) {
    static const std::regex no_member(
        R"re(^\s*(using|typedef|friend|static|constexpr|template|class|struct|enum)\b[^]*)re");
    if (std::regex_match(head, no_member) || is_function(head)) return 0;
    const std::string plain = without_templates(head);
    if (plain.find_first_not_of(" \t\n") == std::string::npos || plain == "of_class ") return 0;
    int depth = 0, count = 1;
    for (const char c : plain) {
      depth += c == '(' || c == '[' ? 1 : c == ')' || c == ']' ? -1 : 0;
      count += c == ',' && depth == 0 ? 1 : 0;
    }
    return count;
  }

  const std::string& code_;
  std::size_t at_ = 0;
  std::map<std::string, int> counts_;
};

TEST(HouseMembers, AreCounted) {
  const std::string code = code_of(R"re(
    namespace a { namespace {
    struct Outer : Base<int> {
      Outer() : x{1}, y(2) { int no = 3; }
      enum class Kind { one, two } kind = Kind::one;  // int commented;
      struct Inner { std::map<int, std::string> m; int a = 0, b{2}, c; void f(int, int) const; };
      std::function<bool(int, int)> call;
      static constexpr int nothing = 1;
      void g(Inner = {}, int = {});
      bool operator==(const Outer&) const = default;
      double values[3] = {1, 2, 3}, *p;
      const char* text = "int quoted; {";
     private:
      friend class Other;
      using T = int;
      int x = f(1, 2), y;
      Inner inner;
    };
    int f(int g) { struct Local { int a, b; }; return 0; }
    }}
    class Outer::Later { int a; };)re");
  const Members members(code);
  const std::map<std::string, int> expected{{"Outer", 8}, {"Outer::Inner", 4}, {"Outer::Later", 1}};
  EXPECT_EQ(members.counts(), expected);
}

/// A class with more is several, or has a part that should have a name.
TEST(HouseMembers, AreFew) {
  std::map<std::string, int> unused = larger;
  int checked = 0;
  for (const char* const folder : {"runtime", "compiler", "tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cpp" && extension != ".h") continue;
      const std::string code = code_of(read(entry.path()));
      const Members members(code);
      for (const auto& [name, count] : members.counts()) {
        ++checked;
        if (count <= most_members) continue;
        const std::string key = fs::relative(entry.path(), source_root).generic_string() + " " + name;
        const auto listed = larger.find(key);
        unused.erase(key);
        EXPECT_TRUE(listed != larger.end() && count <= listed->second) << "{\"" << key << "\", " << count << "},";
        EXPECT_TRUE(listed == larger.end() || count >= listed->second) << key << " has " << count << " now: say so";
      }
    }
  }
  for (const auto& [key, count] : unused) ADD_FAILURE() << key << " is listed and has no more than others may";
  EXPECT_GT(checked, 500);
}

/// What a rollout is made of, in runtime/src/run: each file includes its own header and earlier ones.
TEST(HouseMembers, PartsOfARolloutSeeOneWay) {
  const std::vector<std::string> order{"value_ids",  "bound_program", "run_memory",     "step_inputs", "gradient_sums",
                                       "binder",     "states",        "part_control",   "blocks",      "stepper",
                                       "losses",     "kept_steps",    "adjoint_states", "loss_seeds",  "step_adjoint",
                                       "legs",       "way_back",      "tape_store",     "trajectory",  "run_watch",
                                       "steady_run", "forward_run",   "frames",         "gradient"};
  const auto place = [&](const std::string& name) {
    return std::find(order.begin(), order.end(), name) - order.begin();
  };
  const std::regex include(R"re(#include "run/(?:[a-z]+/)?([a-z_]+)\.h")re");
  for (const auto& entry : fs::recursive_directory_iterator(source_root / "runtime/src/run")) {
    if (!entry.is_regular_file()) continue;
    const std::string text = read(entry.path()), name = entry.path().stem();
    EXPECT_LT(place(name), std::ssize(order)) << name << " has no place";
    for (auto found = std::sregex_iterator(text.begin(), text.end(), include); found != std::sregex_iterator(); ++found)
      EXPECT_LE(place((*found)[1]), place(name)) << entry.path() << ": " << found->str();
  }
}

/// What a rollout has names for is looked up once, when it is made: to all that steps it is a number.
TEST(HouseMembers, PartsOfARolloutLookUpNoNames) {
  const std::regex lookup(
      R"re((field|param|sum|network)_index\(|find_derived\(|find_link\(|rate_in\(|::name\)|BoundWeights::network\)|== ")re");
  int checked = 0;
  for (const auto& entry : fs::recursive_directory_iterator(source_root / "runtime/src/run")) {
    if (!entry.is_regular_file()) continue;
    if (entry.path().stem() == "value_ids") continue;
    const std::string code = read(entry.path());
    ++checked;
    std::smatch found;
    EXPECT_FALSE(std::regex_search(code, found, lookup)) << entry.path() << ": " << found.str();
  }
  EXPECT_GT(checked, 30);
}

}  // namespace
