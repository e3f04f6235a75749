// SPDX-License-Identifier: Apache-2.0
// Vectors and tensors against closed forms: orders of stresses and of waves on edges and faces, gradients, back ends.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

double order_of(const std::string& text, const std::string& scene, const std::string& field, int cells) {
  const auto error = [&](int n) { return run_scene(text, scene, {{"cells", std::to_string(n)}}).l2.at(field); };
  return std::log2(error(cells) / error(2 * cells));
}

/// Viscous stresses of a flow without divergence, for which div(2 mu sym(grad v)) is mu lap(v).
std::string viscous(const std::string& on) {
  return "model m { vector v " + on +
         "; param mu; dt(v) = div(2*mu*sym(grad(v))) }\nscheme s { time = rk4 }\n"
         "scene eddy : m with s {\n  grid x = 0 .. 1, cells 16, periodic\n  grid y = 0 .. 1, cells 16, periodic\n"
         "  mu = 0.01\n  let w = 2*pi\n"
         "  initial v = (sin(w*x)*cos(w*y), -cos(w*x)*sin(w*y))\n"
         "  exact v = (sin(w*x)*cos(w*y)*exp(-2*mu*w^2*t), -cos(w*x)*sin(w*y)*exp(-2*mu*w^2*t))\n"
         "  time 0 .. 1, step 1/256\n}\n"
         "scene short = eddy { cells 5, 4; time 0 .. 0.1, step 0.01 }\n"
         "scene other = short { mu = 0.02; initial v = (sin(w*y), 0.3) }\n"
         "task t : short {\n  data r = v from scene other\n  unknown mu\n  unknown initial v\n"
         "  minimise mean(|v - r|^2) + mean(inner(grad(v), grad(v)))\n}\n";
}

TEST(Tensors, StressesAreOfOrderTwo) {
  for (const char* on : {"", "on faces"}) {
    for (const char* field : {"v.x", "v.y"}) EXPECT_NEAR(order_of(viscous(on), "eddy", field, 32), 2, 0.05) << on;
  }
}

/// A pressure wave along the diagonal of an elastic cube: velocities on faces, stresses at centres and on edges
/// (Virieux 1986).
const std::string elastic = R"(
model elastic {
  vector v on faces
  field sxx, syy, szz
  field sxy on edges.z
  field sxz on edges.y
  field syz on edges.x
  param lambda, mu
  let S = ((sxx, sxy, sxz), (sxy, syy, syz), (sxz, syz, szz))
  let e = sym(grad(v))
  dt(v) = div(S)
  dt(sxx) = lambda*trace(e) + 2*mu*e.xx
  dt(syy) = lambda*trace(e) + 2*mu*e.yy
  dt(szz) = lambda*trace(e) + 2*mu*e.zz
  dt(sxy) = 2*mu*e.xy
  dt(sxz) = 2*mu*e.xz
  dt(syz) = 2*mu*e.yz
}
scheme s { time = rk4 }
function f(x, y, z, t, c) = sin(2*pi*(x + y + z - sqrt(3)*c*t))
scene cube : elastic with s {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 8, periodic
  grid z = 0 .. 1, cells 8, periodic
  lambda = 2
  mu = 1
  let c = sqrt(lambda + 2*mu)
  let w = f(x, y, z, t, c)
  let w_0 = f(x, y, z, 0, c)
  initial v = (w_0/sqrt(3), w_0/sqrt(3), w_0/sqrt(3))
  initial sxx = -(lambda + 2*mu/3)/c*w_0
  initial syy = -(lambda + 2*mu/3)/c*w_0
  initial szz = -(lambda + 2*mu/3)/c*w_0
  initial sxy = -2*mu/3/c*w_0
  initial sxz = -2*mu/3/c*w_0
  initial syz = -2*mu/3/c*w_0
  exact v = (w/sqrt(3), w/sqrt(3), w/sqrt(3))
  exact sxy = -2*mu/3/c*w
  exact szz = -(lambda + 2*mu/3)/c*w
  time 0 .. 0.125, step 1/128
}
scene short = cube { cells 3; time 0 .. 0.0625, step 1/64 }
task t : short {
  unknown mu
  unknown initial sxy
  unknown initial v
  minimise mean(dot(v, v)) + mean(sxy^2 + szz^2)
}
)";

TEST(Tensors, ElasticWavesOnEdgesAreOfOrderTwo) {
  for (const char* field : {"v.x", "v.z", "sxy", "szz"}) EXPECT_NEAR(order_of(elastic, "cube", field, 8), 2, 0.1);
}

/// Light along the diagonal of a cube (Yee 1966): E on edges, B on faces, whose divergence is conserved.
const std::string yee = R"(
model maxwell {
  vector E on edges
  vector B on faces
  param c
  dt(E) = c*curl(B)
  dt(B) = -c*curl(E)
}
scheme s { time = rk4 }
scene cube : maxwell with s {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 8, periodic
  grid z = 0 .. 1, cells 8, periodic
  c = 1
  let w = sin(2*pi*(x + y + z - sqrt(3)*c*t))
  let w_0 = sin(2*pi*(x + y + z))
  initial E = (w_0/sqrt(2), -w_0/sqrt(2), 0)
  initial B = (w_0/sqrt(6), w_0/sqrt(6), -2*w_0/sqrt(6))
  exact E = (w/sqrt(2), -w/sqrt(2), 0)
  exact B = (w/sqrt(6), w/sqrt(6), -2*w/sqrt(6))
  time 0 .. 0.25, step 1/128
}
scene short = cube { cells 3; time 0 .. 0.0625, step 1/64 }
task t : short {
  unknown c
  unknown initial E
  minimise mean(|E|^2) + integral((dot(B, B) + x*dot(E, E))/2)
}
)";

TEST(Tensors, LightOnEdgesAndFacesIsOfOrderTwo) {
  for (const char* field : {"E.x", "B.z"}) EXPECT_NEAR(order_of(yee, "cube", field, 8), 2, 0.05);
}

/// The same model in two dimensions between mirrors: E.x lies on the walls across y, where it is 0.
const std::string light_box = R"(
model light {
  vector E on edges
  field H
  dt(E) = curl(H)
  dt(H) = -curl(E)
}
scheme s { time = rk4 }
scene box : light with s {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 1, cells 8
  boundary E.x: y = 0, x = zero_gradient
  boundary E.y: x = 0, y = zero_gradient
  boundary H = zero_gradient
  let w = pi*sqrt(2)
  initial E = (0, 0)
  initial H = cos(pi*x)*cos(pi*y)
  exact H = cos(pi*x)*cos(pi*y)*cos(w*t)
  exact E = (-cos(pi*x)*sin(pi*y)*sin(w*t)*pi/w, sin(pi*x)*cos(pi*y)*sin(w*t)*pi/w)
  time 0 .. 0.5, step 1/256
}
scene short = box { cells 4, 3; time 0 .. 0.1, step 0.02 }
task t : short {
  data r = E from scene short at t = 0
  unknown initial H
  unknown initial E
  minimise mean(dot(E - r, E - r)) + mean(H^2)
}
)";

TEST(Tensors, ModesOfACavityAreOfOrderTwo) {
  for (const char* field : {"E.x", "E.y", "H"}) EXPECT_NEAR(order_of(light_box, "box", field, 8), 2, 0.05) << field;
}

/// In polar coordinates the gradient of a constant vector is 0, and the divergences of its outer product and of
/// q*identity are 0 and grad(q). Squares of errors of order 2 fall by 16.
TEST(Tensors, KnowThatDirectionsTurn) {
  const auto square = [](const std::string& on, const std::string& of, int cells) {
    const std::string text =
        "model m { vector v " + on + "; field q; dt(v) = 0; dt(q) = 0 }\nscene ring : m {\n  grid r = 1 .. 2, cells " +
        std::to_string(cells) + "\n  grid theta = 0 .. 2*pi, cells " + std::to_string(2 * cells) +
        ", periodic\n  coordinates polar\n  boundary v: r = linear\n  boundary q: r = linear\n"
        "  initial v = (cos(theta), -sin(theta))\n  initial q = r*cos(theta)\n"
        "  time 0 .. 1, step 1\n}\ntask t : ring {\n  unknown initial v\n  minimise mean(if(abs(r - "
        "1.5) < 0.2, 1, 0)*" +
        of + ")\n}\n";
    return task_loss(text, "t");
  };
  for (const char* part : {"grad(v).xx^2", "grad(v).xy^2", "grad(v).yx^2", "grad(v).yy^2"}) {
    for (const char* on : {"", "on faces"}) {
      const double coarse = square(on, part, 16), fine = square(on, part, 32);
      EXPECT_LT(coarse, 1e-5) << part << on;
      if (coarse > 1e-20) EXPECT_NEAR(std::log2(coarse / fine), 4, 0.3) << part << on;
    }
  }
  EXPECT_NEAR(std::log2(square("", "|div(outer(v, v))|^2", 16) / square("", "|div(outer(v, v))|^2", 32)), 4, 0.3);
  EXPECT_LT(square("", "|div(q*identity) - grad(q)|^2", 16), 1e-25);
}

/// Sod's tube (1978) with one flux operator on any number of axes: the exact values between the waves; in a plane all
/// rows are equal.
std::string tube(int axes) {
  return std::string(R"(
operator lax(q, f, c) order 1 = div(f) - div(hx/2*c*grad(q))
model gas {
  field rho, E
  vector m
  param gamma = 1.4
  let v = m/rho
  let p = (gamma - 1)*(E - 0.5*dot(m, v))
  let c = |v| + sqrt(gamma*p/rho)
  dt(rho) = -lax(rho, m, c)
  dt(m) = -lax(m, outer(m, v) + p*identity, c)
  dt(E) = -lax(E, (E + p)*v, c)
}
scheme s { time = ssp_rk3 }
scene sod : gas with s {
  grid x = 0 .. 1, cells 400
)") + (axes == 2 ? "  grid y = 0 .. 0.01, cells 4, periodic\n" : "") +
         "  boundary rho = zero_gradient\n  boundary E = zero_gradient\n  boundary m = zero_gradient\n"
         "  initial rho = if(x < 0.5, 1, 0.125)\n  initial E = if(x < 0.5, 1, 0.1)/(gamma - 1)\n  initial m = 0\n"
         "  time 0 .. 0.2, step 1/2000\n}\n";
}

TEST(Tensors, SodsTubeByOneFluxOperator) {
  const auto line = run_scene(tube(1), "sod").state, plane = run_scene(tube(2), "sod").state;
  const auto &rho = line.at("rho"), &m = line.at("m.x");
  EXPECT_NEAR(m[240] / rho[240], 0.92745, 0.01);  // after the rarefaction
  EXPECT_NEAR(rho[230], 0.42632, 0.01);
  EXPECT_NEAR(rho[320], 0.26557, 0.01);  // between the contact and the shock
  EXPECT_NEAR(rho[360], 0.125, 1e-3);    // before the shock, which is at 0.8504
  for (std::size_t i = 0; i < rho.size(); ++i) {
    for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(plane.at("rho")[j * rho.size() + i], rho[i], 1e-12);
    EXPECT_NEAR(plane.at("m.y")[i], 0, 1e-14);
  }
}

TEST(Tensors, DerivativesAreCertified) {
  for (const std::string& text : {viscous(""), viscous("on faces"), elastic, yee, light_box}) {
    const auto certificate = certificate_of(text, true);
    ASSERT_TRUE(certificate);
    EXPECT_TRUE(certificate->passed());
    EXPECT_LT(certificate->worst(), 1e-11);
  }
}

TEST(Tensors, BackEndsAgree) {
  for (const std::string& text : {viscous("on faces"), yee, light_box}) {
    const auto jit = run_scene(text, "short").state;
    const auto oracle = run_scene(text, "short", {}, driver::Backend::interpreter).state;
    const auto cpp = run_scene(text, "short", {}, driver::Backend::cpp).state;
    for (const auto& [name, values] : oracle) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_NEAR(jit.at(name)[i], values[i], 1e-13) << name;
        EXPECT_NEAR(cpp.at(name)[i], values[i], 1e-13) << name;
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
