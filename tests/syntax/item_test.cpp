// SPDX-License-Identifier: Apache-2.0
// Each kind of item and block: what is read, and its canonical text.
#include <gtest/gtest.h>

#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

template <class Block>
Block only_block(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const File file = parse(source, sink);
  EXPECT_EQ(problems(source, sink), "");
  EXPECT_EQ(file.declarations.size(), 1u);
  return std::get<Block>(file.declarations.at(0).kind);
}

TEST(Items, OfModels) {
  const std::string text = "model m { field u, v; coefficient kappa; param Da, Db\n let s = u + v; dt(u) = lap(s) }";
  const Model model = only_block<Model>(text);
  ASSERT_EQ(model.items.size(), 5u);
  EXPECT_EQ(model.name.name, "m");
  EXPECT_EQ(get<FieldItem>(model.items[0].kind).names[1].name, "v");
  EXPECT_EQ(get<CoefficientItem>(model.items[1].kind).names[0].name, "kappa");
  EXPECT_EQ(get<ParamItem>(model.items[2].kind).names.size(), 2u);
  EXPECT_EQ(get<LetItem>(model.items[3].kind).name.name, "s");
  EXPECT_EQ(get<EquationItem>(model.items[4].kind).field.name, "u");
  EXPECT_EQ(print(get<EquationItem>(model.items[4].kind).rhs), "lap(s)");
  const auto written = [&](const Item& item) {
    return text.substr(item.range.begin, item.range.end - item.range.begin);
  };
  EXPECT_EQ(written(model.items[0]), "field u, v");
  EXPECT_EQ(written(model.items[4]), "dt(u) = lap(s)");
}

TEST(Items, OfRepeats) {
  const std::string text =
      "program p {\n"
      "  repeat 8 {\n"
      "    fill u x periodic, y = 0\n"
      "    repeat 2 { run fast; swap w, q }\n"
      "    reduce m = mean w\n"
      "    swap u, v\n"
      "  }\n"
      "  keep m\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Program program = only_block<Program>(text);
  ASSERT_EQ(program.items.size(), 2u);
  const auto& repeat = get<RepeatItem>(program.items[0].kind);
  EXPECT_EQ(repeat.count, 8);
  EXPECT_EQ(text.substr(repeat.count_range.begin, 1), "8");
  ASSERT_EQ(repeat.items.size(), 4u);
  const auto& inner = get<RepeatItem>(repeat.items[1].kind);
  EXPECT_EQ(inner.count, 2);
  EXPECT_EQ(get<RunItem>(inner.items.at(0).kind).kernel.name, "fast");
  EXPECT_EQ(get<SwapItem>(inner.items.at(1).kind).next.name, "q");
  EXPECT_EQ(text.substr(program.items[0].range.begin, 8), "repeat 8");
}

TEST(Items, OfControls) {
  const Model model =
      only_block<Model>("model m { control F, G; control field H on faces.x; control vector V, W; control field }");
  ASSERT_EQ(model.items.size(), 4u);
  EXPECT_EQ(get<ControlItem>(model.items[0].kind).names.size(), 2u);
  const CoefficientItem& field = get<CoefficientItem>(model.items[1].kind);
  EXPECT_EQ(field.names[0].name, "H");
  EXPECT_TRUE(field.control && !field.vector && field.on);
  const CoefficientItem& vector = get<CoefficientItem>(model.items[2].kind);
  EXPECT_TRUE(vector.control && vector.vector && !vector.on);
  EXPECT_EQ(vector.names.size(), 2u);
  EXPECT_EQ(get<ControlItem>(model.items[3].kind).names[0].name, "field");  // a name like others
}

TEST(Items, OfScenes) {
  const std::string text =
      "scene s : m with cheap {\n"
      "  grid x = -1 .. 1, cells 128, periodic\n"
      "  grid y = 0 .. 2*pi\n"
      "  nu = 0.01/pi\n"
      "  initial u = -sin(pi*x) projected\n"
      "  exact u = exp(-t)*sin(x)\n"
      "  boundary u: x.low = 0, x.high = 1, y = periodic\n"
      "  boundary v = 0\n"
      "  time 0 .. 1, step 1/32\n"
      "  time 0 .. 2\n"
      "  step 1/32\n"
      "  observe e = mean(u^2)\n"
      "  initial v = load(\"run.nc\", v) at t = 1/2\n"
      "  output u, v every 0.1\n"
      "  subcycle u, w.x in 4\n"
      "  output w\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Scene scene = only_block<Scene>(text);
  EXPECT_EQ(scene.of.name, "m");
  EXPECT_EQ(scene.scheme->name, "cheap");
  const auto& grid = get<GridItem>(scene.items[0].kind);
  EXPECT_EQ(print(grid.low), "-1");
  EXPECT_EQ(print(*grid.cells), "128");
  EXPECT_TRUE(grid.periodic);
  EXPECT_FALSE(get<GridItem>(scene.items[1].kind).cells.has_value());
  EXPECT_EQ(get<ValueItem>(scene.items[2].kind).name.name, "nu");
  const auto& boundary = get<BoundaryItem>(scene.items[5].kind);
  ASSERT_EQ(boundary.sides.size(), 3u);
  EXPECT_EQ(boundary.sides[1].place.name, "x.high");
  EXPECT_EQ(text.substr(boundary.sides[1].place.range.begin, 6), "x.high");
  EXPECT_EQ(boundary.sides[2].place.name, "y");
  EXPECT_EQ(get<BoundaryItem>(scene.items[6].kind).sides[0].place.name, "all");
  EXPECT_FALSE(get<TimeItem>(scene.items[8].kind).step.has_value());
}

TEST(Items, OfScenesMayBeCalledLikeKeywords) {
  const Scene scene = only_block<Scene>("scene s : m { step = 3; time = 4; grid = 5 }");
  ASSERT_EQ(scene.items.size(), 3u);
  EXPECT_EQ(get<ValueItem>(scene.items[0].kind).name.name, "step");
}

TEST(Items, OfSchemes) {
  const Scheme scheme = only_block<Scheme>("scheme cheap { advect = semi_lagrangian; lap = central(2); real = f64 }");
  ASSERT_EQ(scheme.items.size(), 3u);
  EXPECT_EQ(print(get<ValueItem>(scheme.items[1].kind).value), "central(2)");
}

TEST(Items, OfTasks) {
  const std::string text =
      "task t : s with cheap {\n"
      "  data a = load(\"a.npy\")\n"
      "  data b = u from scene fine at t = 0.5, 1.0\n"
      "  data c = u from scene fine over time\n"
      "  unknown initial u from 0\n"
      "  unknown nu from 0.01\n"
      "  unknown initial\n"
      "  minimise mean((u - a)^2) at t = 0.5, 1\n"
      "  minimise mean(u^2) over time\n"
      "  minimise mean(u^2)\n"
      "  using gradient_descent(rate = 5), iterations 50\n"
      "  using lbfgs(10)\n"
      "  test mae = mean(abs(u - a)) over time\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Task task = only_block<Task>(text);
  const auto& data = get<DataItem>(task.items[1].kind);
  EXPECT_EQ(data.scene->name, "fine");
  EXPECT_EQ(std::get<WhenAt>(data.when).times.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<WhenOver>(get<DataItem>(task.items[2].kind).when));
  EXPECT_TRUE(get<UnknownItem>(task.items[3].kind).initial);
  EXPECT_FALSE(get<UnknownItem>(task.items[4].kind).initial);
  EXPECT_EQ(get<UnknownItem>(task.items[5].kind).name.name, "initial");
  EXPECT_TRUE(std::holds_alternative<WhenEnd>(get<MinimiseItem>(task.items[8].kind).when));
  const auto& use = get<UsingItem>(task.items[9].kind);
  ASSERT_EQ(use.options.size(), 1u);
  EXPECT_EQ(use.options[0].name, "iterations");
  EXPECT_EQ(text.substr(use.options[0].name_range.begin, 10), "iterations");
  EXPECT_TRUE(get<UsingItem>(task.items[10].kind).options.empty());
}

TEST(Items, OfTasksThatTrain) {
  const std::string text =
      "task t : s {\n"
      "  data a = trajectories(\"wake.nc\", u)\n"
      "  learn corrector from \"start.safetensors\"\n"
      "  learn other\n"
      "  minimise mean((u - a)^2) over 4 steps\n"
      "  minimise mean(u^2) over 2*n steps\n"
      "  using adam(rate = 1e-3, decay = 1e-4), batch 4, unroll (1, 2, 4), clip 1.0, gradient cut\n"
      "  test e = mean(abs(u - a)) on trajectories(\"test.nc\") for 250 steps\n"
      "  test f = mean(u) over time on trajectories(\"test.nc\")\n"
      "  test g = mean(u) on trajectories(\"test.nc\") for 9 steps beside plain, fine on trajectories(\"fine.nc\")\n"
      "  statistic energy = mean(u^2) on trajectories(\"test.nc\") for 9 steps beside plain\n"
      "  growth rate on trajectories(\"test.nc\") for 9 steps\n"
      "  spectrum s = curl(u) on trajectories(\"test.nc\") for 9 steps beside plain\n"
      "  correlation c = u on trajectories(\"test.nc\") for 9 steps\n"
      "  correlation d = u above 0.9 on trajectories(\"test.nc\") for 9 steps\n"
      "  test h = mean(u) on trajectories(\"test.nc\") for 9 steps beside vortex on trajectories(\"fine.nc\") where "
      "omega = curl(u), psi = u.x, plain\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Task task = only_block<Task>(text);
  EXPECT_EQ(get<LearnItem>(task.items[1].kind).network.name, "corrector");
  EXPECT_EQ(std::get<Text>((*get<LearnItem>(task.items[1].kind).from)->kind).value, "start.safetensors");
  EXPECT_FALSE(get<LearnItem>(task.items[2].kind).from.has_value());
  EXPECT_EQ(print(std::get<WhenSteps>(get<MinimiseItem>(task.items[4].kind).when).steps), "2*n");
  const auto& use = get<UsingItem>(task.items[5].kind);
  ASSERT_EQ(use.options.size(), 4u);
  EXPECT_EQ(std::get<Tuple>(use.options[1].value->kind).elements.size(), 3u);
  EXPECT_EQ(std::get<Name>(use.options[3].value->kind).name, "cut");
  const auto& test = get<TestItem>(task.items[6].kind);
  EXPECT_EQ(print(*test.on), "trajectories(\"test.nc\")");
  EXPECT_EQ(print(*test.steps), "250");
  EXPECT_FALSE(get<TestItem>(task.items[7].kind).steps.has_value());
  const auto& compared = get<TestItem>(task.items[8].kind);
  ASSERT_EQ(compared.beside.size(), 2u);
  EXPECT_FALSE(compared.beside[0].on.has_value());
  EXPECT_EQ(compared.beside[1].scene.name + print(*compared.beside[1].on), "finetrajectories(\"fine.nc\")");
  EXPECT_EQ(get<TestItem>(task.items[9].kind).kind, TestItem::Kind::statistic);
  EXPECT_EQ(get<TestItem>(task.items[10].kind).kind, TestItem::Kind::growth);
  EXPECT_EQ(get<TestItem>(task.items[11].kind).kind, TestItem::Kind::spectrum);
  EXPECT_EQ(get<TestItem>(task.items[12].kind).kind, TestItem::Kind::correlation);
  EXPECT_FALSE(get<TestItem>(task.items[12].kind).above.has_value());
  EXPECT_EQ(print(*get<TestItem>(task.items[13].kind).above), "0.9");
  const auto& mapped = get<TestItem>(task.items[14].kind);
  ASSERT_EQ(mapped.beside.size(), 2u);
  ASSERT_EQ(mapped.beside[0].map.size(), 2u);
  EXPECT_EQ(mapped.beside[0].map[1].name.name + print(*mapped.beside[0].map[0].value), "psicurl(u)");
  EXPECT_TRUE(mapped.beside[1].map.empty());
}

TEST(Items, OfDataSets) {
  const std::string text =
      "dataset train : fine with plain {\n"
      "  runs 10\n"
      "  seed 3\n"
      "  vary nu in 0.01 .. 0.1\n"
      "  vary s from 100\n"
      "  vary k in 0.1 .. 10 logarithmic\n"
      "  vary re in 100, 2*100\n"
      "  frames of u, q.x, c[1], omega = curl(u), w on nodes = u*v every 1/16 from 3 to 23\n"
      "  coarsen 4\n"
      "  file \"train.nc\"\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const DataSet set = only_block<DataSet>(text);
  EXPECT_EQ(set.of.name, "fine");
  EXPECT_EQ(get<OptionItem>(set.items[0].kind).name.name, "runs");
  EXPECT_EQ(print(*get<VaryItem>(set.items[2].kind).high), "0.1");
  EXPECT_FALSE(get<VaryItem>(set.items[3].kind).low.has_value());
  EXPECT_TRUE(get<VaryItem>(set.items[4].kind).is_log);
  EXPECT_EQ(print(get<VaryItem>(set.items[5].kind).values.at(1)), "2*100");
  EXPECT_EQ(print(get<FramesItem>(set.items[6].kind).every), "1/16");
  EXPECT_EQ(print(*get<FramesItem>(set.items[6].kind).to), "23");
  const std::vector<NamedFormula>& of = get<FramesItem>(set.items[6].kind).of;
  ASSERT_EQ(of.size(), 5U);
  EXPECT_EQ(of[1].name.name, "q.x");
  EXPECT_FALSE(of[2].value.has_value());
  EXPECT_EQ(print(of[3].value.value()), "curl(u)");
  EXPECT_EQ(of[4].on.value().name, "nodes");
}

TEST(Items, OfCharts) {
  const std::string text =
      "chart cost : wave with plain {\n"
      "  reference self(cells = 8192)\n"
      "  vary scheme in cheap, precise\n"
      "  vary advect in central(2), upwind(3)  # two\n"
      "  vary cells in 64, 128\n"
      "  error l2(u), linf(v) at t = 1\n"
      "  gradient recover\n"
      "  tolerance 1e-3\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Chart chart = only_block<Chart>(text);
  EXPECT_EQ(chart.of.name, "wave");
  EXPECT_EQ(chart.scheme->name, "plain");
  EXPECT_EQ(print(get<ReferenceItem>(chart.items[0].kind).value), "self(cells = 8192)");
  EXPECT_EQ(get<ChoicesItem>(chart.items[1].kind).key.name, "scheme");
  EXPECT_EQ(get<ChoicesItem>(chart.items[2].kind).values.size(), 2u);
  EXPECT_EQ(get<ErrorItem>(chart.items[4].kind).norms.size(), 2u);
  EXPECT_EQ(print(*get<ErrorItem>(chart.items[4].kind).at), "1");
  EXPECT_EQ(get<OptionItem>(chart.items[5].kind).name.name, "gradient");
}

TEST(Items, OfScenesThatSayHowAccurateTheyAre) {
  const std::string text = "scene s : m {\n  accuracy 1e-3 on u, v.x\n  accuracy 0.1\n}\n";
  EXPECT_EQ(formatted(text), text);
  const Scene scene = only_block<Scene>(text);
  const auto& accuracy = get<AccuracyItem>(scene.items[0].kind);
  EXPECT_EQ(print(accuracy.tolerance), "1e-3");
  ASSERT_EQ(accuracy.fields.size(), 2u);
  EXPECT_EQ(accuracy.fields[1].name, "v.x");
  EXPECT_TRUE(get<AccuracyItem>(scene.items[1].kind).fields.empty());
}

TEST(Items, OfKernels) {
  const std::string text =
      "kernel k(u, f: field halo 1, out v: field, inout w: field, sum nu_bar: param, nu, hx, dt: param) on 2 axes {\n"
      "  let ux = (u[+1, 0] - u[-1, 0])/(2*hx)\n"
      "  v = u + dt*ux\n"
      "  w += u\n"
      "  nu_bar += ux\n"
      "  interp(w, 0.5, d) += ux\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Kernel kernel = only_block<Kernel>(text);
  ASSERT_EQ(kernel.parameters.size(), 8u);
  EXPECT_EQ(kernel.axes, 2);
  const KernelRole roles[] = {KernelRole::in,  KernelRole::in,    KernelRole::out,   KernelRole::inout,
                              KernelRole::sum, KernelRole::param, KernelRole::param, KernelRole::param};
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(kernel.parameters[i].role, roles[i]) << i;
  EXPECT_EQ(kernel.parameters[1].halo, 1);
  EXPECT_FALSE(kernel.parameters[2].halo.has_value());
  EXPECT_FALSE(get<AssignItem>(kernel.items[1].kind).accumulate);
  EXPECT_TRUE(get<AssignItem>(kernel.items[2].kind).accumulate);
  EXPECT_EQ(print(get<ScatterItem>(kernel.items[4].kind).target), "interp(w, 0.5, d)");
  EXPECT_TRUE(only_block<Kernel>("kernel k() { }").parameters.empty());
  EXPECT_EQ(only_block<Kernel>("kernel k(out: param) {}").parameters[0].name.name, "out");
}

TEST(Items, OfPrograms) {
  const std::string text =
      "program p {\n"
      "  axes x periodic, y bounded\n"
      "  fill u periodic\n"
      "  fill u x periodic, y.low = 0, y.high = zero_gradient\n"
      "  fill v = a + 1\n"
      "  fill w zero_gradient\n"
      "  fold u grow 2 x periodic, y = 0\n"
      "  run k\n"
      "  run k grow 1\n"
      "  swap u, v\n"
      "  keep a, b\n"
      "  reduce m = mean u\n"
      "  reduce over = max v.x over x, z\n"
      "}\n";
  EXPECT_EQ(formatted(text), text);
  const Program program = only_block<Program>(text);
  EXPECT_EQ(get<FillItem>(program.items[1].kind).sides[0].place.name, "all");
  EXPECT_EQ(get<FillItem>(program.items[2].kind).sides[1].place.name, "y.low");
  EXPECT_TRUE(get<FillItem>(program.items[5].kind).fold);
  EXPECT_EQ(get<FillItem>(program.items[5].kind).grow, 2);
  EXPECT_EQ(get<RunItem>(program.items[7].kind).grow, 1);
  EXPECT_EQ(get<SwapItem>(program.items[8].kind).next.name, "v");
  EXPECT_TRUE(get<ReduceItem>(program.items[10].kind).axes.empty());
  EXPECT_EQ(get<ReduceItem>(program.items[11].kind).kind, Reduction::max);
  EXPECT_EQ(get<ReduceItem>(program.items[11].kind).axes[1].name, "z");
}

TEST(Items, OfLoops) {
  const Loop loop = only_block<Loop>("loop t in 0 .. 32 { wave_step }");
  EXPECT_EQ(loop.to, 32);
  EXPECT_EQ(loop.body[0].name, "wave_step");
  EXPECT_EQ(only_block<Loop>("loop t in 32..-1 { a; b\n c }").body.size(), 3u);
  EXPECT_EQ(only_block<Loop>("loop t in 32..-1 { a }").to, -1);
}

TEST(Items, AreSeparatedByLinesOrSemicolons) {
  EXPECT_EQ(formatted("model m\n{\n\n;; field u;\n;field v\n}"), "model m {\n  field u\n  field v\n}\n");
  EXPECT_EQ(formatted("model m { dt(u) =\n  a\n  + b -\n  c\n field v }"),
            "model m {\n  dt(u) = a + b - c\n  field v\n}\n");
}

TEST(Items, NoFileAtAll) {
  EXPECT_EQ(formatted(""), "");
  EXPECT_EQ(formatted("\n \n"), "");
  EXPECT_EQ(formatted("# only this"), "# only this\n");
}

// design/language.md, as written there
TEST(Sketches, InverseProblem) {
  EXPECT_EQ(formatted("# Which initial state leads to this one at t = 0.5?\n"
                      "model burgers {\n"
                      "  field u\n"
                      "  param nu\n"
                      "  dt(u) = -advect(u, u) + nu*lap(u)\n"
                      "}\n"
                      "\n"
                      "scene wave : burgers {\n"
                      "  grid x = -1 .. 1, cells 128, periodic\n"
                      "  nu = 0.01/pi\n"
                      "  initial u = -sin(pi*x)\n"
                      "  time 0 .. 1, step 1/32\n"
                      "}\n"
                      "\n"
                      "scheme cheap   { advect = semi_lagrangian; lap = central(2); time = euler; real = f64 }\n"
                      "scheme precise { advect = weno(5); lap = central(4); time = ssp_rk3 }\n"
                      "\n"
                      "task recover : wave with cheap {\n"
                      "  data     u_ref = load(\"burgers_t05.npy\")\n"
                      "  unknown  initial u from 0\n"
                      "  minimise mean((u - u_ref)^2) at t = 0.5\n"
                      "  using    gradient_descent(rate = 5), iterations 50\n"
                      "}\n"),
            "# Which initial state leads to this one at t = 0.5?\n"
            "model burgers {\n"
            "  field u\n"
            "  param nu\n"
            "  dt(u) = -advect(u, u) + nu*lap(u)\n"
            "}\n"
            "\n"
            "scene wave : burgers {\n"
            "  grid x = -1 .. 1, cells 128, periodic\n"
            "  nu = 0.01/pi\n"
            "  initial u = -sin(pi*x)\n"
            "  time 0 .. 1, step 1/32\n"
            "}\n"
            "\n"
            "scheme cheap { advect = semi_lagrangian; lap = central(2); time = euler; real = f64 }\n"
            "scheme precise { advect = weno(5); lap = central(4); time = ssp_rk3 }\n"
            "\n"
            "task recover : wave with cheap {\n"
            "  data u_ref = load(\"burgers_t05.npy\")\n"
            "  unknown initial u from 0\n"
            "  minimise mean((u - u_ref)^2) at t = 0.5\n"
            "  using gradient_descent(rate = 5), iterations 50\n"
            "}\n");
}

TEST(Sketches, OneLevelDown) {
  EXPECT_EQ(formatted("# The same language one level down: what the compiler prints and a person may write.\n"
                      "kernel burgers_step(u: field halo 1, out v: field, nu, h, dt: param) {\n"
                      "  let ux = (u[+1] - u[-1]) / (2*h)\n"
                      "  v = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/h^2)\n"
                      "}\n"
                      "program wave_step {\n"
                      "  fill u periodic\n"
                      "  run burgers_step\n"
                      "  swap u, v\n"
                      "}\n"
                      "loop t in 0 .. 32 { wave_step }\n"),
            "# The same language one level down: what the compiler prints and a person may write.\n"
            "kernel burgers_step(u: field halo 1, out v: field, nu, h, dt: param) {\n"
            "  let ux = (u[+1] - u[-1])/(2*h)\n"
            "  v = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/h^2)\n"
            "}\n"
            "program wave_step {\n"
            "  fill u periodic\n"
            "  run burgers_step\n"
            "  swap u, v\n"
            "}\n"
            "loop t in 0 .. 32 { wave_step }\n");
}

}  // namespace
}  // namespace dpde::ast
