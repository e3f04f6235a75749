// SPDX-License-Identifier: Apache-2.0
// Files for other programs: names, times with units, compression, values at centres, a description for ParaView,
// gradients with their certificates.
#include <cmath>
#include <filesystem>

#include "command_support.h"
#include "dpde/runtime/netcdf.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

class FilesForOthers : public Command {};

std::string canal(const std::string& axis, const std::string& boundary) {
  return "model water { vector u on faces; field eta; dt(eta) = -div(u); dt(u) = -grad(eta) }\n"
         "scheme s { time = rk4 }\n"
         "scene canal : water with s {\n  grid x = 0 .. 1, cells 8" +
         axis + "\n" + boundary + "  initial u = 0.25 + x\n  initial eta = 0\n  time 0 .. 0.125, step 1/32\n}\n";
}

TEST_F(FilesForOthers, NamesAreWordsAndTimeHasAUnit) {
  write("canal.dpde", canal("", "  boundary u = 0.25\n  boundary eta = zero_gradient\n"));
  ASSERT_EQ(dpde("run canal.dpde canal --quiet --centres --out o").status, 0);
  const NetcdfFile file(path("o/canal.nc").string());
  EXPECT_EQ(file.dimensions("u_x"), (std::vector<std::string>{"time", "x_faces"}));
  EXPECT_EQ(file.text("u_x", "dpde_name"), "u.x");
  EXPECT_EQ(file.text("u_x", "long_name"), "field u.x");
  EXPECT_EQ(file.text("time", "standard_name"), "time");
  EXPECT_EQ(file.text("time", "units"), "") << "nothing is told: not a pure number";
  // At the centres: the mean of the faces; on the low wall the boundary's value.
  EXPECT_EQ(file.dimensions("u_x_centre"), (std::vector<std::string>{"time", "x"}));
  const std::vector<double> faces = file.values("u_x"), centres = file.values("u_x_centre");
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NEAR(centres[i], 0.5 * ((i == 0 ? 0.25 : faces[i - 1]) + faces[i]), 1e-15) << i;
}

TEST_F(FilesForOthers, UnitsThatTheModelTells) {
  write("rod.dpde",
        "model heat { field T in K; param k = 1e-3 in m^2/s, n = 2; dt(T) = k*lap(T) }\nscene rod : heat {\n"
        "  grid x = 0 .. 1 in m, cells 8, periodic\n  initial T = 1\n  observe heat = integral(T)\n"
        "  time 0 .. 1 in day, step 1/8\n}\n");
  const Outcome scaled = dpde("run rod.dpde --quiet --out o");
  EXPECT_EQ(scaled.status, 2);
  EXPECT_NE(scaled.err.find("E0342"), std::string::npos) << scaled.err;
  const std::string text = content(path("rod.dpde"));
  write("rod.dpde", std::string(text).replace(text.find("m^2/s"), 5, "m^2/day"));
  const Outcome run = dpde("run rod.dpde --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.json().at("units"), (Json{{"T", "K"}, {"heat", "K*m"}, {"k", "m^2/day"}, {"t", "day"}, {"x", "m"}}));
  const NetcdfFile file(path("o/rod.nc").string());
  EXPECT_EQ(file.text("T", "units"), "K");
  EXPECT_EQ(file.text("x", "units"), "m");
  EXPECT_EQ(file.text("time", "units"), "day");
  EXPECT_NE(dpde("run rod.dpde").out.find("heat = 1 K*m\n"), std::string::npos);
  EXPECT_NE(dpde("check rod.dpde --all").out.find("T: state in K\n"), std::string::npos);
  EXPECT_NE(dpde("emit rod.dpde --stage model").out.find("# units: T in K, heat in K*m, k in m^2/day"),
            std::string::npos);
}

/// In files and pictures; the dimensions are still x and y.
TEST_F(FilesForOthers, AxesAreCalledAsTheirCoordinatesHaveThem) {
  write("earth.dpde",
        "model heat { field u; dt(u) = lap(u) }\nscene earth : heat {\n  coordinates sphere(1)\n"
        "  grid lon = 0 .. 2*pi, cells 8, periodic\n  grid lat = -pi/2 .. pi/2, cells 4\n  boundary u: lat = pole\n"
        "  initial u = sin(lat)\n  time 0 .. 1e-3, step 1e-3\n}\n");
  ASSERT_EQ(dpde("run earth.dpde --quiet --out o").status, 0);
  const NetcdfFile file(path("o/earth.nc").string());
  EXPECT_EQ(file.text("y", "long_name"), "lat of the cell centres");
  EXPECT_EQ(file.text("y", "dpde_axis"), "lat");
  ASSERT_EQ(dpde("plot o/earth.nc --quiet --out p").status, 0);
  for (const std::string picture : {"o/earth.svg", "p/earth_u.svg"})
    EXPECT_NE(content(path(picture)).find(">lon [\u00b0]<"), std::string::npos) << picture;
  EXPECT_EQ(content(path("p/earth_u.svg")).find(">7<"), std::string::npos) << "numbers of cells";
  const std::string fields = dpde("plot o/earth.nc --field w").err;
  EXPECT_NE(fields.find("it holds the fields u\n"), std::string::npos) << fields;
}

TEST_F(FilesForOthers, CentresOnPeriodicAndSlopingSides) {
  write("ring.dpde", canal(", periodic", ""));
  ASSERT_EQ(dpde("run ring.dpde canal --quiet --centres --out o").status, 0);
  const NetcdfFile ring(path("o/canal.nc").string());
  EXPECT_NEAR(ring.values("u_x_centre")[0], 0.5 * (ring.values("u_x")[7] + ring.values("u_x")[0]), 1e-15);
}

TEST_F(FilesForOthers, NamesThatCollideStayApart) {
  write("two.dpde",
        "model m { vector u; field u_x; dt(u) = -u; dt(u_x) = -u_x }\nscene s : m {\n  grid x = 0 .. 1, cells 4, "
        "periodic\n  initial u = 1\n  initial u_x = 2\n  time 0 .. 1, step 1/8\n}\n");
  ASSERT_EQ(dpde("run two.dpde --quiet --out o").status, 0);
  const NetcdfReader reader(content(path("o/s.nc")), "s.nc");
  ASSERT_NE(reader.find("u.x"), nullptr);
  EXPECT_EQ(reader.find("u.x")->stored_name, "u_x_");
  EXPECT_EQ(reader.read(*reader.find("u.x"), 0)[0], 1);
  EXPECT_EQ(reader.read(*reader.find("u_x"), 0)[0], 2);
}

TEST_F(FilesForOthers, LargeFieldsAreCompressedWithoutLoss) {
  write("rod.dpde", rod_text);
  ASSERT_EQ(dpde("run rod.dpde rod --set cells=16384 --set step=1e-9 --set end=1e-8 --quiet --out o").status, 0);
  const NetcdfReader reader(content(path("o/rod.nc")), "rod.nc");
  const std::vector<double> u = reader.read(*reader.find("u"), 1);
  ASSERT_EQ(u.size(), 16384u);
  EXPECT_LT(std::filesystem::file_size(path("o/rod.nc")), 5u * 16384 * sizeof(double));  // x, bounds, two states
}

TEST_F(FilesForOthers, ThreeAxesAreDescribedForParaView) {
  write("block.dpde",
        "model m { field u; dt(u) = 0.01*lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 "
        ".. 1, cells 3, periodic\n  grid z = 0 .. 1, cells 2, periodic\n  initial u = x + 10*y\n  time 0 .. 1, step "
        "1/8\n  output u every 1/4\n}\n");
  const Outcome run = dpde("run block.dpde --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string xdmf = content(path("o/s.xdmf"));
  EXPECT_EQ(shell("command -v xmllint >/dev/null || exit 0; xmllint --noout o/s.xdmf").status, 0);
  EXPECT_NE(xdmf.find("NumberOfElements=\"3 4 5\""), std::string::npos) << xdmf;
  EXPECT_NE(xdmf.find("<Time Value=\"0.25\"/>"), std::string::npos) << xdmf;
  EXPECT_NE(xdmf.find("1 0 0 0 1 1 1 1 1 2 3 4<"), std::string::npos) << xdmf;
  EXPECT_NE(xdmf.find("Dimensions=\"5 2 3 4\">s.nc:/u<"), std::string::npos) << xdmf;
  EXPECT_EQ(NetcdfFile(path("o/s.nc").string()).dimensions("u"), (std::vector<std::string>{"time", "z", "y", "x"}));
}

TEST_F(FilesForOthers, AGradientHasItsCertificateBesideIt) {
  std::string text = rod_text;
  text.replace(text.find("unknown k from 0.25"), 19, "unknown initial u from 0.5*sin(x)");
  write("rod.dpde", text);
  const Outcome outcome = dpde("gradient rod.dpde find --json --certify --out o");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::optional<Json> kept = parse_json(content(path("o/find_gradient.json")));
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->at("loss"), outcome.json()["loss"]);
  EXPECT_EQ(kept->at("certificate"), outcome.json()["certificate"]);
  const NetcdfFile file(path("o/find_gradient.nc").string());
  EXPECT_EQ(file.dimensions("gradient_u"), std::vector<std::string>{"x"});
  EXPECT_NE(file.text("", "history").find("dpde gradient rod.dpde find"), std::string::npos);
  const std::optional<Json> certificate = parse_json(file.text("", "dpde_certificate"));
  ASSERT_TRUE(certificate.has_value());
  EXPECT_LT(certificate->at("dot_product").get<double>(), 1e-11);
  // The solution is a wave times a factor f per step, f^8 at the end: d mean(u^2)/du_i = 2*f^16*u_i/16.
  const double h = 2 * std::acos(-1.0) / 16, f = 1 - 4 * 0.3 / 8 / (h * h) * std::pow(std::sin(h / 2), 2);
  const std::vector<double> gradient = file.values("gradient_u"), x = file.values("x");
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR(gradient[i], 2 * std::pow(f, 16) * 0.5 * std::sin(x[i]) / 16, 1e-14) << i;
}

}  // namespace
}  // namespace dpde::testing
