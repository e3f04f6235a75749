// SPDX-License-Identifier: Apache-2.0
// Every command with every user error: a message and the right exit status, never a crash or a hang.
#include <algorithm>

#include "command_support.h"

namespace dpde::testing {
namespace {

using BadInput = Command;

const char* const verbs[] = {"run", "check", "emit --stage stencil", "verify", "gradient", "optimize", "bench", "fmt"};

TEST_F(BadInput, FilesThatCannotBeRead) {
  fs::create_directory(path("folder.dpde"));
  for (const std::string verb : verbs) {
    for (const std::string file : {"missing.dpde", "folder.dpde", "/dev/zero"}) {
      const Outcome run = dpde(verb + " " + file);
      EXPECT_EQ(run.status, 2) << verb << file;
      EXPECT_NE(run.err.find("error[E0901]"), std::string::npos) << verb << file << run.err;
    }
  }
}

TEST_F(BadInput, FilesThatMakeNoSense) {
  std::string garbage(4000, ' ');
  for (std::size_t i = 0; i < garbage.size(); ++i) garbage[i] = static_cast<char>((i * 2654435761u) >> 13);
  write("garbage.dpde", garbage);
  write("deep.dpde", "model m { field u\n dt(u) = " + std::string(100000, '(') + "u }\n");
  for (const std::string verb : verbs) {
    EXPECT_EQ(dpde(verb + " garbage.dpde").status, 2) << verb;
    EXPECT_EQ(dpde(verb + " deep.dpde").status, 2) << verb;
  }
  write("empty.dpde", "");
  for (const std::string verb : {"run", "check", "verify", "gradient", "optimize", "bench", "emit --stage loop"}) {
    const Outcome run = dpde(verb + " empty.dpde");
    EXPECT_EQ(run.status, 2) << verb;
    EXPECT_NE(run.err.find("E0908"), std::string::npos) << verb << run.err;
  }
}

TEST_F(BadInput, OptionsThatDoNotFit) {
  write("rod.dpde", rod_text);
  for (const std::string arguments :
       {"", "nonsense", "runn rod.dpde", "run", "run rod.dpde --frobnicate", "run rod.dpde nosuch",
        "run rod.dpde --backend gpu", "run rod.dpde --set =", "run rod.dpde --set k", "run rod.dpde --set cells=-1",
        "run rod.dpde --set cells=many", "run rod.dpde --set nosuch=1", "run rod.dpde --set time=rk9",
        "run rod.dpde --scheme nosuch", "run rod.dpde --threads -3", "run rod.dpde --every 0", "gradient rod.dpde rod",
        "gradient rod.dpde find --memory lots", "gradient rod.dpde find --memory 1"}) {
    const Outcome run = dpde(arguments + " --json");
    EXPECT_EQ(run.status, 2) << arguments << run.err;
    EXPECT_FALSE(run.codes().empty()) << arguments;
    EXPECT_NE(run.err, "") << arguments;
  }
  EXPECT_NE(dpde("chek rod.dpde").err.find("did you mean check?"), std::string::npos);
}

TEST_F(BadInput, HelpOfEveryVerbHasAnExample) {
  for (const std::string verb : {"run", "check", "emit", "verify", "gradient", "optimize", "bench", "plot", "fmt"}) {
    const Outcome help = dpde(verb + " --help");
    EXPECT_EQ(help.status, 0) << verb;
    EXPECT_NE(help.out.find("dpde " + verb + " "), std::string::npos) << help.out;
  }
}

TEST_F(BadInput, PlacesThatCannotBeWritten) {
  write("rod.dpde", rod_text);
  write("file", "");
  for (const std::string arguments :
       {"run rod.dpde rod --out /proc/nothing", "run rod.dpde rod --out file/below",
        "optimize rod.dpde find --out /proc/nothing", "gradient rod.dpde find --out file",
        "emit rod.dpde rod --stage ast -o /nowhere/x", "run rod.dpde rod > /dev/full",
        "run rod.dpde rod --json > /dev/full", "emit rod.dpde rod --stage cpp > /dev/full",
        "emit rod.dpde rod --stage cpp -o /dev/full", "run rod.dpde rod --set cells=2000000000"}) {
    const Outcome run = dpde(arguments);
    EXPECT_EQ(run.status, 3) << arguments << run.err;
    EXPECT_NE(run.err.find("error[E09"), std::string::npos) << arguments << run.err;
  }
}

TEST_F(BadInput, AFullDiskIsGivenAsTheReason) {
  write("rod.dpde", rod_text);
  const std::string message = "cannot write standard output: No space left on device";
  for (const std::string arguments : {"run rod.dpde rod", "run rod.dpde rod --json", "check rod.dpde find", "--help",
                                      "check --help", "--version", "run rod.dpde --seed x --json", "walk --json"}) {
    const Outcome outcome = dpde(arguments + " > /dev/full");
    EXPECT_EQ(outcome.status, 3) << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << outcome.err;
  }
}

/// The temporary file of states has no name; the message names the final path.
TEST_F(BadInput, AFolderThatFillsDuringARunIsNamed) {
  write("rod.dpde", rod_text);
  const Outcome outcome = shell(
      "trap '' XFSZ; ulimit -f 4; $DPDE run rod.dpde rod --no-cache --set cells=4096 --set step=1e-9 "
      "--set end=8e-9 --every 1 --out full");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("cannot write full/rod.frames: "), std::string::npos) << outcome.err;
}

TEST_F(BadInput, SeedsThatDoNotFit) {
  write("rod.dpde", rod_text);
  EXPECT_EQ(dpde("run rod.dpde rod --seed 18446744073709551615").status, 0);
  for (const std::string seed : {"18446744073709551616", "99999999999999999999999", "-1", "1.5", "many"}) {
    const Outcome run = dpde("run rod.dpde rod --seed " + seed);
    EXPECT_EQ(run.status, 2) << seed;
    const std::string message = "--seed: " + seed + " is no whole number from 0 to 18446744073709551615\n";
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
  }
}

/// Predictions need no memory per step: 1e9 steps in 2 GiB, where a list of their checkpoints would not fit.
TEST_F(BadInput, PredictionsOfVeryLongRuns) {
  if (is_sanitized) GTEST_SKIP() << "the sanitizers reserve more address space than the test allows";
  std::string text = rod_text;
  text.replace(text.find("time 0 .. 1, step 1/8"), 21, "time 0 .. 1.25e8, step 1/8");
  text.replace(text.find("minimise mean(u^2) at t = 1"), 27, "minimise mean(u^3) at t = 1.25e8");
  text.replace(text.find("dt(u) = k*lap(u)"), 16, "dt(u) = k*lap(u)*u");
  write("rod.dpde", text);
  const Outcome check = shell("ulimit -v 2097152; $DPDE check rod.dpde find --json");
  ASSERT_EQ(check.status, 0) << check.err;
  EXPECT_GT(check.json()["checkpoints"]["stored"], 0);
}

/// A file name is not interpreted as code.
TEST_F(BadInput, ALineBreakInTheNameOfAFile) {
  std::string name = "rod\nint evil() { return 1; }\n.dpde";
  write(name, rod_text);
  const std::string quoted = "'" + name + "'";
  for (const std::string& arguments :
       {"emit " + quoted + " rod --stage cpp", "build " + quoted + " rod -o lib > .log; cat lib/*.h lib/*.cpp"}) {
    const Outcome run = dpde(arguments);
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.out.find("int evil()"), std::string::npos) << "the name is there";
    EXPECT_EQ(run.out.find("\nint evil()"), std::string::npos) << arguments;
  }
}

/// A .npy file of float64.
std::string npy(const std::string& shape, const std::vector<double>& values) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + ", }";
  header += std::string(117 - header.size(), ' ') + "\n";
  std::string bytes = std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' + header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * 8);
  return bytes;
}

TEST_F(BadInput, DataThatDoNotFit) {
  std::string text = rod_text;
  text.replace(text.find("initial u = sin(x)"), 18, "initial u = load(\"u.npy\")");
  write("rod.dpde", text);
  const auto code = [&](const std::string& options = "") {
    const Outcome run = dpde("run rod.dpde rod --json" + options);
    EXPECT_EQ(run.status, run.json()["diagnostics"].empty() ? 0 : 2) << run.err;
    return run.codes().empty() ? std::string() : run.codes()[0];
  };
  EXPECT_EQ(code(), "E0901");
  std::vector<double> values(16, 1.0);
  write("u.npy", npy("(16,)", values));
  EXPECT_EQ(code(), "");
  write("u.npy", npy("(4, 4)", values));
  EXPECT_EQ(code(), "E0905");
  write("u.npy", npy("(15,)", std::vector<double>(15, 1.0)));
  EXPECT_EQ(code(), "E0905");
  values[3] = NAN;
  write("u.npy", npy("(16,)", values));
  EXPECT_EQ(code(), "E0906");
  values[3] = 1e39;
  write("u.npy", npy("(16,)", values));
  EXPECT_EQ(code(), "");
  EXPECT_EQ(code(" --set real=f32"), "E0915");
  EXPECT_NE(dpde("check rod.dpde --all rod --set real=f32").err.find("holds 1e+39 at index 3, which f32 cannot hold"),
            std::string::npos);
  write("u.npy", npy("(16,)", values).substr(0, 150));
  EXPECT_EQ(code(), "E0907");
  write("u.npy", "not an array");
  EXPECT_EQ(code(), "E0907");
}

TEST_F(BadInput, DataOfAnotherSceneThatDoNotFit) {
  const auto with = [&](const std::string& fine, const std::string& data) {
    write("rod.dpde",
          std::string(rod_text) + "scene fine : heat with ftcs {\n  grid x = 0 .. 2*pi, cells " + fine +
              ", periodic\n  k = 0.3\n  initial u = sin(x)\n  time 0 .. 1, step 1/16\n}\ntask t : rod {\n  data d = " +
              data + "\n  unknown k\n  minimise mean((u - d)^2) at t = 0.5, 1\n}\n");
    return dpde("gradient rod.dpde t --json");
  };
  EXPECT_EQ(with("32", "u from scene fine at t = 0.5").status, 0);
  EXPECT_EQ(with("24", "u from scene fine at t = 0.5").codes(),
            (std::vector<std::string>{"W0701", "E0909"}));  // not a multiple of 16, and of another time
  EXPECT_EQ(with("32", "u from scene fine at t = 0.25, 0.5").codes(),
            std::vector<std::string>{"E0912"});  // no state at t = 1
}

TEST_F(BadInput, AFirstSceneRunsAndIsCertifiedAndIsNotWrittenTwice) {
  ASSERT_EQ(dpde("new rod.dpde").status, 0);
  EXPECT_EQ(dpde("fmt rod.dpde --check").status, 0);
  EXPECT_EQ(dpde("verify rod.dpde find_k").status, 0);
  const Outcome found = dpde("optimize rod.dpde find_k --json");
  ASSERT_EQ(found.status, 0) << found.err;
  const Outcome again = dpde("new rod.dpde");
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("rod.dpde is there already"), std::string::npos);
  const Outcome spaced = dpde("new 'my rod.dpde'");
  EXPECT_NE(spaced.out.find("dpde run 'my rod.dpde' rod"), std::string::npos) << spaced.out;
}

TEST_F(BadInput, AFolderIsNotLeftEmpty) {
  write("m.dpde", "model m { field u in Ohm; dt(u) = -u }\n");
  EXPECT_EQ(dpde("run m.dpde --out o").status, 2);
  EXPECT_FALSE(fs::exists(path("o")));
  fs::create_directory(path("mine"));
  EXPECT_EQ(dpde("run m.dpde --out mine").status, 2);
  EXPECT_TRUE(fs::exists(path("mine")));
}

TEST_F(BadInput, CodesAreExplainedByAnExample) {
  const Outcome known = dpde("explain E0705");
  EXPECT_EQ(known.status, 0);
  EXPECT_NE(known.out.find("E0705 not-reduced (error)"), std::string::npos);
  EXPECT_NE(known.out.find("minimise u^2  # <-- here"), std::string::npos) << known.out;
  EXPECT_NE(dpde("explain E0801").out.find("# $ dpde run blow-up.dpde\n"), std::string::npos);
  EXPECT_EQ(dpde("explain E0807").status, 0);  // no example
  EXPECT_EQ(dpde("explain E9999").status, 2);
  write("twice.dpde",
        "model m { field u; dt(u) = v + w }\nscene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = 1; time 0 "
        ".. 1, step 0.1 "
        "}\n");
  const Outcome checked = dpde("check twice.dpde --explain");
  EXPECT_EQ(checked.status, 2);
  EXPECT_EQ(checked.out, "\n" + dpde("explain E0301").out) << "once, after all else";
}

}  // namespace
}  // namespace dpde::testing
