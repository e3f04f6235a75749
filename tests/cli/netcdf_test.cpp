// SPDX-License-Identifier: Apache-2.0
// NetCDF output of runs and input of scenes and tasks; pictures of stored runs. Files are checked with the C library
// only.
#include <cmath>
#include <numbers>

#include "command_support.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

double rod_value(int steps, int i) {
  const double h = 2 * std::numbers::pi / 16, s = std::sin(h / 2);
  return std::pow(1 - 4 * 0.3 / 8 / (h * h) * s * s, steps) * std::sin((i + 0.5) * h);
}

std::string exchanged(std::string text, const std::string& old, const std::string& fresh) {
  text.replace(text.find(old), old.size(), fresh);
  return text;
}

class Netcdf : public Command {
 protected:
  void run_rod(const std::string& items = "", const std::string& options = "") const {
    write("rod.dpde", exchanged(rod_text, "  observe", items + "  observe"));
    const Outcome run = dpde("run rod.dpde rod --quiet --out o " + options);
    ASSERT_EQ(run.status, 0) << run.err;
  }
  void expect_states(const NetcdfFile& file, const std::string& field, const std::vector<int>& steps) const {
    const std::vector<double> values = file.values(field);
    ASSERT_EQ(values.size(), 16 * steps.size());
    for (std::size_t k = 0; k < steps.size(); ++k) {
      for (int i = 0; i < 16; ++i) EXPECT_NEAR(values[16 * k + i], rod_value(steps[k], i), 1e-14) << field << steps[k];
    }
  }
  /// A scene that starts from a file, stepped 4 times of 1/8.
  Outcome run_from(const std::string& load, const std::string& options = "") const {
    write("from.dpde",
          exchanged(exchanged(rod_text, "sin(x)\n  observe", load + "\n  observe"), "time 0 .. 1", "time 0 .. 1/2"));
    return dpde("run from.dpde rod --json --out p " + options);
  }
  Outcome must_refuse(const std::string& load, const std::string& code, const std::string& words) const {
    const Outcome run = run_from(load);
    EXPECT_EQ(run.status, 2) << load;
    EXPECT_EQ(run.codes(), std::vector<std::string>{code}) << run.err;
    EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("from.dpde:10:"), std::string::npos) << run.err;
    return run;
  }
};

TEST_F(Netcdf, HoldsTheFirstAndTheLastStateWithCoordinates) {
  run_rod();
  const NetcdfFile file(path("o/rod.nc").string());
  EXPECT_EQ(file.dimensions("u"), (std::vector<std::string>{"time", "x"}));
  EXPECT_EQ(file.values("time"), (std::vector<double>{0, 1}));
  expect_states(file, "u", {0, 8});
  const std::vector<double> x = file.values("x"), bounds = file.values("x_bounds");
  ASSERT_EQ(bounds.size(), 32u);
  for (int i = 0; i < 16; ++i) {
    EXPECT_NEAR(x[i], (i + 0.5) * std::numbers::pi / 8, 1e-14);
    EXPECT_NEAR(bounds[2 * i + 1], (i + 1) * std::numbers::pi / 8, 1e-14);
  }
  EXPECT_EQ(file.text("x", "axis"), "X");
  EXPECT_EQ(file.text("x", "units"), "");
  EXPECT_EQ(file.text("x", "bounds"), "x_bounds");
  EXPECT_EQ(file.text("time", "axis"), "T");
  EXPECT_EQ(file.text("", "Conventions"), "CF-1.8");
  EXPECT_EQ(file.values("k"), std::vector<double>{0.3});
  EXPECT_NEAR(file.values("size")[0], 0.5, 1e-15);
}

TEST_F(Netcdf, ASeriesWhereTheSceneAsks) {
  run_rod("  output u every 3/8\n");
  const NetcdfFile file(path("o/rod.nc").string());
  EXPECT_EQ(file.values("time"), (std::vector<double>{0, 0.375, 0.75, 1}));
  expect_states(file, "u", {0, 3, 6, 8});
}

TEST_F(Netcdf, IntervalsOfTheirOwn) {
  write("two.dpde",
        "model m {\n  field u, v, time\n  dt(u) = -u\n  dt(v) = -v\n  dt(time) = 1\n}\nscheme e { time = euler "
        "}\nscene s : m {\n"
        "  grid x = 0 .. 1, cells 2, periodic\n  grid y = 0 .. 1, cells 1, periodic\n  initial u = 1\n  initial v = x\n"
        "  initial time = y\n  time 0 .. 1, step 1/4\n  output u every 1/2\n  output v, time every 1/4\n}\n");
  const Outcome run = dpde("run two.dpde --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const NetcdfFile file(path("o/s.nc").string());
  EXPECT_EQ(file.dimensions("u"), (std::vector<std::string>{"time_", "y", "x"}));
  EXPECT_EQ(file.values("time_"), (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(file.values("u"), (std::vector<double>{1, 1, 0.5625, 0.5625, 0.31640625, 0.31640625}));
  EXPECT_EQ(file.dimensions("v"), (std::vector<std::string>{"time__", "y", "x"}));
  EXPECT_EQ(file.values("v").size(), 10u);
  EXPECT_EQ(file.values("time"), (std::vector<double>{0.5, 0.5, 0.75, 0.75, 1, 1, 1.25, 1.25, 1.5, 1.5}));
}

TEST_F(Netcdf, TellsHowToMakeItAgain) {
  run_rod("", "--set k=0.2 --set step=1/16 --seed 5");
  const NetcdfFile file(path("o/rod.nc").string());
  std::string options;
  std::stringstream settings(file.text("", "dpde_settings"));
  for (std::string line; std::getline(settings, line);) options += " --set " + line;
  EXPECT_EQ(options, " --set k=0.2 --set step=1/16");
  write("again.dpde", file.text("", "dpde_text"));
  ASSERT_EQ(dpde("run again.dpde " + file.text("", "dpde_scene") + options + " --quiet --out p").status, 0);
  EXPECT_EQ(NetcdfFile(path("p/rod.nc").string()).values("u"), file.values("u"));
  EXPECT_NE(file.text("", "dpde_scheme").find("time = euler"), std::string::npos);
  EXPECT_NE(file.text("", "history").find("--seed 5"), std::string::npos);
}

TEST_F(Netcdf, AnInterruptedRunKeepsItsLastState) {
  write("rod.dpde", rod_text);
  ASSERT_EQ(
      interrupted("run rod.dpde rod --set end=1e8 --quiet --checkpoint-every 1000 --out o", "0.1", "o/rod.restart")
          .status,
      by_ctrl_c);
  const NetcdfFile file(path("o/rod.nc").string());
  const std::size_t states =
      file.values("time").size();  // only the first time if the signal came before the first step
  EXPECT_TRUE(states == 1 || states == 2) << states;
  EXPECT_EQ(file.values("u").size(), 16 * states);
}

TEST_F(Netcdf, AFullDiskLeavesNothing) {
  write("rod.dpde", rod_text);
  const Outcome run = shell("trap '' XFSZ; ulimit -f 8; $DPDE run rod.dpde rod --quiet --out o");
  EXPECT_EQ(run.status, 3) << run.err;
  EXPECT_NE(run.err.find("rod.nc"), std::string::npos) << run.err;
  for (const auto& entry : fs::directory_iterator(path("o"))) {
    EXPECT_EQ(entry.path().string().find(".nc"), std::string::npos) << entry.path();
  }
}

TEST_F(Netcdf, ASceneStartsFromAStoredState) {
  run_rod("  output u every 1/4\n");
  ASSERT_EQ(run_from("load(\"o/rod.nc\", u) at t = 1/2").status, 0);
  expect_states(NetcdfFile(path("p/rod.nc").string()), "u", {4, 8});
  ASSERT_EQ(run_from("load(\"o/rod.nc\")").status, 0);  // the only field, its last state
  expect_states(NetcdfFile(path("p/rod.nc").string()), "u", {8, 12});
}

TEST_F(Netcdf, ATaskComparesWithStoredStates) {
  run_rod("  output u every 1/8\n");
  for (const std::string when : {" at t = 0.5", " over time", " at t = 0.25, 0.75"}) {
    write("task.dpde", exchanged(exchanged(rod_text, "unknown k from 0.25",
                                           "data r = load(\"o/rod.nc\", u)" + when + "\n  unknown k from 0.25"),
                                 "mean(u^2) at t = 1", "mean((u - r)^2)" + when));
    const Outcome fit = dpde("optimize task.dpde find --json --iterations 30");
    ASSERT_EQ(fit.status, 0) << fit.err;
    EXPECT_NEAR(fit.json()["unknowns"]["k"]["value"], 0.3, 1e-6) << when;
  }
}

TEST_F(Netcdf, ACoefficientFromAFile) {
  run_rod();
  std::string text = exchanged(rod_text, "  param k\n", "  coefficient k\n");
  text = exchanged(exchanged(text, "k = 0.3", "k = load(\"o/rod.nc\", u)"), "dt(u) = k*lap(u)", "dt(u) = k");
  text = exchanged(text, "  exact u = exp(-k*t)*sin(x)\n", "");
  write("c.dpde", text.substr(0, text.find("task")));
  ASSERT_EQ(dpde("run c.dpde --quiet --out p").status, 0);
  const std::vector<double> u = NetcdfFile(path("p/rod.nc").string()).values("u");
  for (int i = 0; i < 16; ++i) EXPECT_NEAR(u[16 + i], rod_value(0, i) + rod_value(8, i), 1e-13);
}

TEST_F(Netcdf, RefusesWhatDoesNotFit) {
  run_rod("  output u every 1/2\n");
  must_refuse("load(\"o/rod.nc\", w)", "E0907", "it has no variable w; it holds the fields u");
  must_refuse("load(\"o/none.nc\")", "E0901", "No such file");
  must_refuse("load(\"o/rod.nc\", u) at t = 0.3", "E0912", "the nearest is t = 0.5");
  must_refuse("load(\"o/rod.nc\", x) at t = 0.5", "E0912", "it holds no times");
  must_refuse("sin(x) at t = 0.5", "E0311", "load(\"name.nc\", u) at t = 0.5");
  const std::string whole = content(path("o/rod.nc"));
  write("half.nc", whole.substr(0, whole.size() / 2));
  must_refuse("load(\"half.nc\")", "E0907", "half.nc is no NetCDF file or is damaged");
  write("text.nc", "not at all");
  must_refuse("load(\"text.nc\")", "E0907", "text.nc is no NetCDF file");
}

/// Own spellings, and those of CF.
TEST_F(Netcdf, ComparesUnits) {
  const auto rod = [](const std::string& unit) {
    return "model heat { field T in " + unit +
           "; dt(T) = 0*T }\nscene rod : heat { grid x = 0 .. 1, cells 4, "
           "periodic; initial T = 1; time 0 .. 1, step 1 }\nscene next = rod { initial T = load(\"o/rod.nc\") }\n";
  };
  const auto codes = [&](const std::string& unit) {
    write("rod.dpde", rod(unit));
    return dpde("check rod.dpde next --json").codes();
  };
  write("rod.dpde", rod("kg/(m*s^2)"));
  ASSERT_EQ(dpde("run rod.dpde rod --quiet --out o").status, 0);
  EXPECT_EQ(codes("Pa"), std::vector<std::string>{});
  EXPECT_EQ(codes("hPa"), std::vector<std::string>{"E0342"});
  EXPECT_EQ(codes("K"), std::vector<std::string>{"E0341"});
}

TEST_F(Netcdf, RefusesAnotherGrid) {
  run_rod();
  const Outcome finer = run_from("load(\"o/rod.nc\", u)", "--set cells=32");
  EXPECT_EQ(finer.codes(), std::vector<std::string>{"E0905"});
  write("wide.dpde", exchanged(exchanged(rod_text, "0 .. 2*pi", "0 .. 4*pi"), "sin(x)\n  observe",
                               "load(\"o/rod.nc\", u)\n  observe"));
  const Outcome wider = dpde("run wide.dpde rod --json");
  EXPECT_EQ(wider.status, 2);
  EXPECT_NE(wider.err.find("it is of another grid: cell 0 lies at x = 0.19635, here at x = 0.392699"),
            std::string::npos)
      << wider.err;
}

TEST_F(Netcdf, DamageIsFoundWhereverItIs) {
  run_rod();
  const std::string whole = content(path("o/rod.nc"));
  for (std::size_t place = 0; place + 32 < whole.size(); place += whole.size() / 25 + 1) {
    std::string bytes = whole;
    for (std::size_t i = place; i < std::min(place + 8, bytes.size()); ++i) bytes[i] = static_cast<char>(~bytes[i]);
    write("bad.nc", bytes);
    const Outcome run = run_from("load(\"bad.nc\", u)", "--backend interpreter");
    EXPECT_EQ(run.status, 2) << place;
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0907"}) << place << run.err;
  }
}

TEST_F(Netcdf, PlotsTheLastStateOrAllAsFrames) {
  run_rod("  output u every 1/2\n");
  const Outcome plot = dpde("plot o/rod.nc --field u --json");
  ASSERT_EQ(plot.status, 0) << plot.err;
  EXPECT_EQ(plot.json()["files"], Json({"o/rod_u.svg", "o/rod_u.png"}));
  EXPECT_NE(content(path("o/rod_u.svg")).find("u, t = 1"), std::string::npos);
  const Outcome video = dpde("plot o/rod.nc --video --json --out v");
  EXPECT_EQ(video.json()["files"], Json({"v/rod_u_0000.png", "v/rod_u_0001.png", "v/rod_u_0002.png"}));
  EXPECT_EQ(content(path("v/rod_u_0002.png")).substr(1, 3), "PNG");
  const Outcome missing = dpde("plot o/rod.nc --field w --json");
  EXPECT_EQ(missing.status, 2);
  EXPECT_EQ(missing.codes(), std::vector<std::string>{"E0907"});
  EXPECT_EQ(dpde("plot none.nc --json").codes(), std::vector<std::string>{"E0901"});
}

TEST_F(Netcdf, PlotsSayWhatIsNotFinite) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }";
  header.resize(117, ' ');
  const auto npy = [&](double a, double b) {
    std::string bytes = std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n";
    for (const double value : {a, b}) bytes.append(reinterpret_cast<const char*>(&value), 8);
    return bytes;
  };
  write("some.npy", npy(1, NAN));
  EXPECT_EQ(dpde("plot some.npy --json").codes(), std::vector<std::string>{"W0901"});
  write("none.npy", npy(INFINITY, NAN));
  const Outcome none = dpde("plot none.npy --json");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("none of the 2 values of none is finite"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace dpde::testing
