// SPDX-License-Identifier: Apache-2.0
// Tasks that train on samples are certified at frames of their data: the scenes here start from 0 everywhere, where
// derivatives carry no information. With verify and optimize, for each kind of unknown and of data.
#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

const std::string still_scenes = R"(
model flow { field u; param nu, a; dt(u) = -u*dx(u) + nu*lap(u) }
model driven { field u; param nu; control field c; dt(u) = -u*dx(u) + nu*lap(u) }
model streams {
  vector v on faces; field u; param nu
  dt(u) = -div(interpolate(u)*v) + nu*lap(u); dt(v) = nu*lap(v) - interpolate(u)*v
}
model growth { field u; param k; dt(u) = k*u*(1 - u) }
scheme plain { time = rk2; networks = f64 }
scheme single { time = rk2; real = f32 }
network corrector(u) { initial he, seed 1; conv 3, 3; tanh; conv out, 3, gain = 0.1 }
scene truth : flow with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.05; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 0.5, step 1/32
}
scene still : flow with plain {
  grid x = 0 .. 2*pi, cells 8, periodic
  nu = 0.05; a = 1
  initial u = 0
  time 0 .. 0.5, step 1/32
}
scene corrected = still { after step: u += u*corrector(u) }
scene corrected_f32 = corrected with single {}
scene steered : driven with plain {
  grid x = 0 .. 2*pi, cells 8, periodic
  nu = 0.05; c = 0 every 1/16
  initial u = 0
  time 0 .. 0.5, step 1/32
  after step: u += c*u
}
scene stream : streams with plain {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 4
  nu = 0.05
  boundary u = 0; boundary v.x: y = 0; boundary v.y: y = 0
  initial u = sin(2*pi*x)*y*(1 - y); initial v = (1 + y, sin(2*pi*x)*y*(1 - y))
  time 0 .. 0.25, step 1/32
}
scene pond = stream { initial u = 0; initial v = (0, 0) }
scene grown : growth with plain {
  grid x = 0 .. 1, cells 3, periodic; k = 1; initial u = 0.1 + 0.1*x; time 0 .. 0.5, step 1/32
}
scene bare = grown { initial u = 0 }
dataset train : truth {
  runs 2; seed 1; vary a in 0.5 .. 1.5; vary nu in 0.01 .. 0.1
  frames every 1/16 from 1/8 to 1/2; coarsen 2; file "train.nc"
}
dataset begun : bare { runs 1; frames every 1/32; file "begun.nc" }
dataset eddies : stream { runs 1; frames every 1/32; file "eddies.nc" }
dataset curves : grown { runs 1; frames every 1/32; file "curves.nc" }
)";

std::string window_task(const std::string& scene, const std::string& data, const std::string& body) {
  return still_scenes + "task t : " + scene + " { data r = trajectories(" + data + "); " + body + " }\n";
}

struct WindowKind {
  const char* name;
  std::string text;
  const char* file;  // of the data
  double t;          // of the frame
};

std::vector<WindowKind> window_kinds() {
  const std::string loss = "minimise mean((u - r)^2) over 4 steps; ", adam = "using adam(rate = 1e-3), epochs 1";
  return {
      {"network", window_task("corrected", "\"train.nc\", u", "learn corrector; " + loss + adam), "train.nc", 0.125},
      {"network of an f32 scene", window_task("corrected_f32", "\"train.nc\", u", "learn corrector; " + loss + adam),
       "train.nc", 0.125},
      {"parameter", window_task("still", "\"train.nc\", u", "unknown nu from 0.2; " + loss + adam), "train.nc", 0.125},
      {"parameter, by lbfgs",
       window_task("still", "\"train.nc\", u", "unknown nu from 0.2; " + loss + "using lbfgs(), epochs 1"), "train.nc",
       0.125},
      {"lengths that grow",
       window_task("corrected", "\"train.nc\", u",
                   "learn corrector; " + loss + "using adam(rate = 1e-3), epochs 2, unroll (2, 4)"),
       "train.nc", 0.125},
      {"control",
       window_task("steered", "\"train.nc\", u", "unknown c from 0.1; " + loss + "using lbfgs(), iterations 2"),
       "train.nc", 0.125},
      {"fields on faces", window_task("pond", "\"eddies.nc\", u", "unknown nu from 0.2; " + loss + adam), "eddies.nc",
       0},
      {"data that a loss only names",
       window_task("still", "\"train.nc\", u",
                   "unknown nu from 0.2; minimise mean(u^2) + 0*mean(r) over 4 steps; " + adam),
       "train.nc", 0.125},
      {"no derivative of space", window_task("bare", "\"curves.nc\", u", "unknown k from 0.4; " + loss + adam),
       "curves.nc", 0},
  };
}

class WindowCertificate : public Command {
 protected:
  void make(const std::string& set, const std::string& options = "") const {
    write("data.dpde", still_scenes);
    ASSERT_EQ(dpde("run data.dpde " + set + " --out . --json " + options).status, 0) << set;
  }
  /// A third of the kinds; all if tests are thorough.
  std::vector<WindowKind> some_kinds() const {
    for (const char* set : {"train", "eddies", "curves"}) make(set);
    std::vector<WindowKind> some;
    std::size_t number = 0;
    for (const WindowKind& kind : window_kinds()) {
      if (is_tried(number++, 3)) some.push_back(kind);
    }
    return some;
  }
};

TEST_F(WindowCertificate, IsOfAFrameOfTheData) {
  for (const WindowKind& kind : some_kinds()) {
    write("t.dpde", kind.text);
    const Outcome told = dpde("verify t.dpde t --json");
    EXPECT_EQ(told.status, 0) << kind.name << told.out << told.err;
    const Json json = told.json();
    EXPECT_TRUE(json["window"]["file"].get<std::string>().ends_with(kind.file)) << kind.name << json["window"];
    EXPECT_EQ(json["window"]["run"], 0) << kind.name;
    EXPECT_EQ(json["window"]["frame"], 0) << kind.name;
    EXPECT_NEAR(json["window"]["t"].get<double>(), kind.t, 1e-12) << kind.name;
    EXPECT_EQ(json["untested"], Json::array()) << kind.name;
    EXPECT_EQ(json["dot_product"]["below_rounding"], false) << kind.name;
    EXPECT_LE(json["dot_product"]["max_relative_error"].get<double>(), 1e-11) << kind.name;
    EXPECT_NE(json["hessian"], nullptr) << kind.name;
  }
}

TEST_F(WindowCertificate, OfTrainingsBegins) {
  for (const WindowKind& kind : some_kinds()) {
    if (std::string(kind.name).find("f32") != std::string::npos) continue;  // rounding hides the quotients
    write("t.dpde", kind.text);
    const std::string options = std::string(kind.name) == "control" ? " --out o" : "";
    const Outcome text = dpde("optimize t.dpde t --certify" + options);
    EXPECT_EQ(text.status, 0) << kind.name << text.out << text.err;
    EXPECT_NE(text.out.find(" cells from frame 0 of run 0 of "), std::string::npos) << kind.name << text.out;
    EXPECT_EQ(text.out.find("not checked"), std::string::npos) << kind.name << text.out;
  }
}

TEST_F(WindowCertificate, SaysInWordsWhereItIs) {
  make("curves");
  make("begun");
  const std::string rest =
      "unknown k from 0.4; minimise mean((u - r)^2) over 4 steps; using adam(rate = 1e-3), epochs 1";
  const auto verified = [&](const std::string& file) {
    write("t.dpde", window_task("bare", "\"" + file + "\", u", rest));
    return dpde("verify t.dpde t");
  };
  const std::string found = verified("curves.nc").out;
  EXPECT_NE(found.find(": tangent against adjoint, from frame 0 of run 0 of "), std::string::npos) << found;
  EXPECT_NE(found.find("\ncertified: "), std::string::npos) << found;
  const Outcome nothing = verified("begun.nc");  // 0 in all frames
  EXPECT_NE(nothing.out.find("\nnothing to certify: all derivatives are 0"), std::string::npos) << nothing.out;
  EXPECT_EQ(nothing.out.find(" certified"), std::string::npos) << nothing.out;
  EXPECT_NE(nothing.err.find("W0816"), std::string::npos) << nothing.err;
  const Outcome none = verified("none.nc");
  EXPECT_NE(none.out.find(", from the scene's own start: no frame of data is at hand (cannot read none.nc"),
            std::string::npos)
      << none.out;
  const Json json = dpde("verify t.dpde t --json").json();
  EXPECT_EQ(json["window"]["file"], nullptr);
  EXPECT_NE(json["window"]["reason"].get<std::string>().find("none.nc"), std::string::npos) << json["window"];
}

/// Frames that are 0, like the scene, are skipped.
TEST_F(WindowCertificate, IsOfTheFirstFrameThatSaysSomething) {
  write("data.dpde", still_scenes +
                         "scene late = grown { initial u = 0; at t = 1/8: u = 0.1 + x }\n"
                         "dataset later : late { runs 1; frames every 1/32; file \"later.nc\" }\n");
  ASSERT_EQ(dpde("run data.dpde later --out . --json").status, 0);
  write("t.dpde", window_task("bare", "\"later.nc\", u",
                              "unknown k from 0.4; minimise mean((u - r)^2) over 4 steps; using lbfgs(), epochs 1"));
  const Json json = dpde("verify t.dpde t --json").json();
  EXPECT_EQ(json["window"]["frame"], 4) << json["window"];
  EXPECT_EQ(json["untested"], Json::array());
}

/// The certificate for one file is not used for another.
TEST_F(WindowCertificate, IsMadeAnewForOtherData) {
  write("t.dpde", window_kinds()[0].text);
  make("train");
  EXPECT_EQ(process("optimize t.dpde t --certify --json").json()["certificate"]["from_cache"], false);
  EXPECT_EQ(process("optimize t.dpde t --json").json()["certificate"]["from_cache"], true);
  make("train", "--set a=0.7 --seed 3");
  EXPECT_EQ(process("optimize t.dpde t --json").json()["certificate"]["from_cache"], false);
}

TEST_F(WindowCertificate, OfATaskWithoutWindowsIsAsItWas) {
  write("t.dpde", still_scenes + "task t : truth { unknown nu; minimise mean(u^2); using lbfgs(), iterations 1 }\n");
  EXPECT_EQ(dpde("verify t.dpde t --json").json()["window"], nullptr);
  EXPECT_NE(dpde("verify t.dpde t").out.find("task t: tangent against adjoint\n"), std::string::npos);
}

/// Without the file, random data are used; two such data differ.
TEST_F(WindowCertificate, DataThatAreMadeUpDiffer) {
  write("t.dpde",
        still_scenes +
            "task t : truth { data p = trajectories(\"none.nc\", p); data q = trajectories(\"none.nc\", q)\n"
            "  data u0 = trajectories(\"none.nc\", u); unknown nu from 0.04\n"
            "  minimise mean((u - u0)^2)/mean((p - q)^2), mean over 2 steps; using adam(rate = 0.1), epochs 1 }\n");
  const Outcome outcome = dpde("verify t.dpde t");
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
}

}  // namespace
}  // namespace dpde::testing
