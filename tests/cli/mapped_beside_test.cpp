// SPDX-License-Identifier: Apache-2.0
// Tests that compare with a scene of other states, through a state map. Diffusion commutes with curl on a periodic grid
// to the last digits: both scenes give the same value of a quantity, known from the task's own scene.
#include <map>

#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string box =
    "grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 1, cells 8, periodic; time 0 .. 1/4, step 1/64; ";

/// Velocities on faces and the stream function at nodes, each with vorticity at nodes; and all fields at centres.
const std::string models =
    "model flow { vector u on faces; field c; param nu, k = 1; dt(u) = k*nu*lap(u); dt(c) = k*nu*lap(c) }\n"
    "model vortex { field omega on nodes; param nu, k = 1; dt(omega) = k*nu*lap(omega) }\n"
    "model stream { field psi on nodes; param nu, k = 1; let v = (dy(psi), -dx(psi)); dt(psi) = k*nu*lap(psi) }\n"
    "model plain_flow { vector u; param nu, k = 1; dt(u) = k*nu*lap(u) }\n"
    "model plain_vortex { field omega; param nu, k = 1; dt(omega) = k*nu*lap(omega) }\n"
    "scene faces : flow { " +
    box +
    "nu = 0.01; initial u = (sin(2*pi*y), sin(4*pi*x)); initial c = sin(2*pi*x) }\n"
    "scene nodes : vortex { " +
    box +
    "nu = 0.01; initial omega = 0 }\n"
    "scene streams : stream { " +
    box +
    "nu = 0.01; initial psi = sin(2*pi*x)*cos(4*pi*y) + sin(2*pi*y) }\n"
    "scene centres : plain_flow { " +
    box +
    "nu = 0.01; initial u = (sin(2*pi*y), sin(4*pi*x)) }\n"
    "scene plain : plain_vortex { " +
    box +
    "nu = 0.01; initial omega = 0 }\n"
    "scene faces_16 = faces { cells 16, 16 }\n"
    "scene nodes_16 = nodes { cells 16, 16 }\n"
    "scene faces_again = faces { }\n";

/// Data with twice the viscosity, different in each run, so that there is an error.
std::string data_of(const std::string& scene, const std::string& more = "") {
  return "scene " + scene + "_true = " + scene + " { k = 2 }\ndataset d : " + scene +
         "_true { runs 2; vary nu in 0.01, 0.03; frames " + more + "every 1/16; file \"" + scene + ".nc\" }\n";
}

std::string task_of(const std::string& scene, const std::string& lines) {
  return "task t : " + scene + " {\n  unknown k from 1 in 0 .. 9\n  using adam(rate = 1e-30), epochs 1\n" + lines +
         "}\n";
}

class MappedBeside : public Command {
 protected:
  void make(const std::string& scene, const std::string& more = "") const {
    write("d.dpde", models + data_of(scene, more));
    const Outcome made = dpde("run d.dpde d --out .");
    ASSERT_EQ(made.status, 0) << made.out << made.err;
  }
  Json learnt(const std::string& task) const {
    write("t.dpde", models + task);
    const Outcome outcome = dpde("optimize t.dpde t --json --out o --beside-named-only");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json();
  }
  /// Checks that scene `beside` gives the same result of test `name` as the task's own scene.
  static void expect_alike(const Json& json, const std::string& name, const std::string& beside) {
    const Json test = json["test"][name], other = test["beside"][beside];
    ASSERT_GT(test["mean"].get<double>(), 1e-3) << name << test;
    ASSERT_EQ(test["runs"].size(), 2U);
    for (std::size_t run = 0; run < 2; ++run)
      EXPECT_NEAR(other["runs"][run].get<double>(), test["runs"][run].get<double>(), 1e-11) << name << test;
  }
};

const std::string on_faces = " on trajectories(\"faces.nc\") for 16 steps beside nodes where omega = curl(u)\n";

TEST_F(MappedBeside, VorticityOfVelocities) {
  make("faces", "of u, c, w = curl(u) ");
  const Json json =
      learnt(task_of("faces",
                     "  data u_ref = trajectories(\"faces.nc\", u)\n"
                     "  data c_ref = trajectories(\"faces.nc\", c)\n"
                     "  data w_ref on nodes = trajectories(\"faces.nc\", w)\n"
                     "  minimise mean((c - c_ref)^2) over 4 steps\n"
                     "  test e = mean(abs(curl(u) - curl(u_ref)))" +
                         on_faces + "  test f = mean(abs(curl(u) - w_ref)) + mean(nu*curl(u_ref)^2)" + on_faces));
  for (const char* name : {"e", "f"}) expect_alike(json, name, "nodes");
}

TEST_F(MappedBeside, EachKindOfTest) {
  make("faces");
  const Json json = learnt(task_of("faces",
                                   "  data u_ref = trajectories(\"faces.nc\", u)\n"
                                   "  minimise mean(dot(u - u_ref, u - u_ref)) over 4 steps\n"
                                   "  statistic s = mean(curl(u)^2)" +
                                       on_faces + "  spectrum p = curl(u)" + on_faces +
                                       "  correlation q = curl(u) above 0.99" + on_faces + "  growth r" + on_faces));
  const auto alike = [](const Json& a, const Json& b) {
    EXPECT_NEAR(a.get<double>(), b.get<double>(), 1e-9 * (1e-3 + std::abs(b.get<double>()))) << a << b;
  };
  const Json &level = json["statistic"]["s"], &energy = json["spectrum"]["p"], &kept = json["correlation"]["q"];
  for (const char* key : {"mean", "deviation"}) {
    alike(level["beside"]["nodes"][key], level[key]);
    alike(level["beside"]["nodes"]["data"][key], level["data"][key]);
  }
  for (std::size_t run = 0; run < 2; ++run)
    alike(energy["beside"]["nodes"]["distance"]["runs"][run], energy["distance"]["runs"][run]);
  for (std::size_t k = 0; k < 4; ++k) alike(kept["beside"]["nodes"]["course"][k], kept["course"][k]);
  EXPECT_LT(json["growth"]["r"]["beside"]["nodes"]["mean"].get<double>(), 0);
}

TEST_F(MappedBeside, VelocitiesOfAStreamFunction) {
  make("streams", "of psi, v ");
  const std::string beside = " on trajectories(\"streams.nc\") for 16 steps beside faces where u = ";
  const Json json =
      learnt(task_of("streams",
                     "  data psi_ref = trajectories(\"streams.nc\", psi)\n"
                     "  data v_ref on faces = trajectories(\"streams.nc\", v)\n"
                     "  minimise mean((psi - psi_ref)^2) over 4 steps\n"
                     "  test e = mean(dot(v - v_ref, v - v_ref))" +
                         beside +
                         "v, c = 0*interpolate(psi)\n"
                         "  test g = mean(dot((dy(psi), -dx(psi)) - v_ref, (dy(psi_ref), -dx(psi_ref)) + v_ref)) on "
                         "trajectories(\"streams.nc\") for 16 steps beside faces_again where u = (dy(psi), "
                         "-dx(psi)), c = 0*interpolate(psi)\n"));
  expect_alike(json, "e", "faces");
  expect_alike(json, "g", "faces_again");
}

TEST_F(MappedBeside, FieldsAtCentres) {
  make("centres");
  const Json json = learnt(task_of("centres",
                                   "  data u_ref = trajectories(\"centres.nc\", u)\n"
                                   "  minimise mean(dot(u - u_ref, u - u_ref)) over 4 steps\n"
                                   "  test e = mean(abs(curl(u) - curl(u_ref))) on trajectories(\"centres.nc\") for 16 "
                                   "steps beside plain where omega = curl(u)\n"));
  expect_alike(json, "e", "plain");
}

/// With a separate grid and file the map is evaluated there: equal to the task's own model on that grid.
TEST_F(MappedBeside, OnAFileOfItsOwn) {
  make("faces");
  make("faces_16");
  const Json json =
      learnt(task_of("faces",
                     "  data u_ref = trajectories(\"faces.nc\", u)\n"
                     "  minimise mean(dot(u - u_ref, u - u_ref)) over 4 steps\n"
                     "  test e = mean(abs(curl(u) - curl(u_ref))) on trajectories(\"faces.nc\") for 16 "
                     "steps beside nodes_16 on trajectories(\"faces_16.nc\") where omega = curl(u), faces_16 "
                     "on trajectories(\"faces_16.nc\")\n"));
  const Json beside = json["test"]["e"]["beside"];
  for (std::size_t run = 0; run < 2; ++run)
    EXPECT_NEAR(beside["nodes_16"]["runs"][run].get<double>(), beside["faces_16"]["runs"][run].get<double>(), 1e-11);
}

/// Errors in a map are reported at their position, also by `check`.
TEST_F(MappedBeside, MistakesAreSaidWhereTheyStand) {
  make("faces", "of u ");
  struct Case {
    const char *test, *beside, *message;
  };
  for (const Case& each : std::initializer_list<Case>{
           {"mean(curl(u)^2)", "plain where omega = curl(u)", "is at faces across"},
           {"mean(x^2)", "nodes where omega = interpolate(c)", "it has no c, of which omega of scene nodes"},
           {"mean(x^2)", "nodes where omega = curl(w)", "w is not known here"},
           {"mean(curl(u)^2)", "nodes where vorticity = curl(u)", "scene nodes has no field vorticity"},
           {"mean(x^2)", "plain where omega = interpolate(u)", "a vector is made of a vector, and a number of"},
           {"mean(dot(u, u))", "nodes where omega = curl(u)", "u is not known here"},
           {"mean(dot(u, u))", "nodes where omega = curl(u)", "scene nodes has what its map makes: write curl(u)"},
           {"mean(curl(u)^2) + mean(u_ref.x)", "nodes where omega = curl(u)", "u_ref is not known here"},
           {"mean(curl(u)^2)", "nodes where omega = curl(u), omega = curl(u)", "omega is given twice"},
           {"mean(x^2)", "nodes", "made of the task's: beside nodes where omega = ..."},
           {"mean(curl(u)^2)",
            "nodes where omega = curl(u)\n  test h = mean(curl(u)^2) on trajectories(\"faces.nc\") for 16 steps beside "
            "nodes where omega = 2*curl(u)",
            "is beside two tests with two maps"}}) {
    SCOPED_TRACE(std::string(each.test) + " " + each.beside);
    write("t.dpde", models + task_of("faces", std::string("  data u_ref = trajectories(\"faces.nc\", u)\n"
                                                          "  minimise mean(dot(u - u_ref, u - u_ref)) over 4 steps\n"
                                                          "  test e = ") +
                                                  each.test + " on trajectories(\"faces.nc\") for 16 steps beside " +
                                                  each.beside + "\n"));
    const Outcome outcome = dpde("check t.dpde --all t");
    EXPECT_EQ(outcome.status, 2) << outcome.out;
    EXPECT_NE(outcome.err.find(each.message), std::string::npos) << outcome.err;
    EXPECT_TRUE(outcome.err.find("t.dpde:18:") != std::string::npos ||
                outcome.err.find("t.dpde:19:") != std::string::npos)
        << outcome.err;
  }
}

/// The task's scene begins with a solve on many cells: too many for the interpreter's dense solver.
TEST_F(MappedBeside, ChecksWhatBeginsWithASolve) {
  const std::string fluid =
      models +
      "model fluid { vector u on faces; field p; param nu = 1e-4, k = 1; dt(u) = k*nu*lap(u) - grad(p); "
      "0 = div(u) gives p }\n"
      "scene projected_faces : fluid { " +
      box +
      "initial u = (sin(2*pi*y), sin(4*pi*x)) projected }\n"
      "scene many = projected_faces { cells 96, 96 }\n"
      "scene many_nodes = nodes { cells 96, 96; nu = 1e-4 }\n"
      "dataset d : many { runs 1; frames every 1/16; file \"many.nc\" }\n";
  write("t.dpde", fluid + task_of("many",
                                  "  data u_ref = trajectories(\"many.nc\", u)\n"
                                  "  minimise mean(dot(u - u_ref, u - u_ref)) over 4 steps\n"
                                  "  statistic s = mean(curl(u)^2) on trajectories(\"many.nc\") for 16 steps beside "
                                  "many_nodes where omega = curl(u)\n"));
  ASSERT_EQ(dpde("run t.dpde d --out .").status, 0);
  EXPECT_EQ(dpde("check t.dpde --all t").status, 0);
}

}  // namespace
}  // namespace dpde::testing
