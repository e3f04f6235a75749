// SPDX-License-Identifier: Apache-2.0
// Names are looked up once, when a rollout is created: all its programs then use the same numbers.
#include "run/value_ids.h"

#include <gtest/gtest.h>

namespace dpde {
namespace {

TEST(ValueIds, AreTheSameInAllPrograms) {
  const char *const step_fields[] = {"u", "k", "u_next"}, *const step_params[] = {"nu", "t"};
  dpde_program step{};
  step.fields = step_fields;
  step.field_count = 3;
  step.params = step_params;
  step.param_count = 2;
  const char *const adjoint_fields[] = {"seed", "u", "u_bar"}, *const sums[] = {"nu_bar"};
  const dpde_link links[] = {{DPDE_LINK_FIELD, "u_next", DPDE_LINK_FIELD, 0},
                             {DPDE_LINK_FIELD, "u", DPDE_LINK_FIELD, 2},
                             {DPDE_LINK_PARAM, "nu", DPDE_LINK_SUM, 0}};
  dpde_program adjoint{};
  adjoint.fields = adjoint_fields;
  adjoint.field_count = 3;
  adjoint.sums = sums;
  adjoint.sum_count = 1;
  adjoint.links = links;
  adjoint.link_count = 3;
  double first = 0, second = 0;
  RolloutSetup setup;
  setup.step = &step;
  setup.adjoint = &adjoint;
  setup.fields = {{"j", &first}, {"k", &first}, {"k", &second}};
  setup.sought = {"k"};
  setup.rates = {"u"};
  const ResolvedSetup resolved(setup);
  const ProgramIds &of_step = resolved.ids(step), &of_adjoint = resolved.ids(adjoint);
  EXPECT_EQ(of_step.fields[0], of_adjoint.fields[1]);
  EXPECT_EQ(of_adjoint.field(of_step.fields[0]), 1);
  EXPECT_EQ(of_adjoint.field(of_step.fields[1]), -1);
  EXPECT_EQ(of_step.param(ValueIds::t), 1);
  EXPECT_EQ(of_step.param(ValueIds::dt), -1);
  EXPECT_EQ(of_adjoint.derived(DPDE_LINK_FIELD, of_step.fields[2]), 0);
  EXPECT_EQ(of_adjoint.derived(DPDE_LINK_PARAM, of_step.params[0]), 0);
  EXPECT_EQ(of_adjoint.derived(DPDE_LINK_FIELD, of_step.params[0]), -1);
  EXPECT_EQ(resolved.fields_at()[of_step.fields[1]], 1);  // the first one with that name
  EXPECT_EQ(resolved.sought_id(0), of_step.fields[1]);
  EXPECT_EQ(resolved.fields_at()[of_step.fields[0]], -1);
  EXPECT_TRUE(resolved.is_rate(of_step.fields[0]));
  EXPECT_EQ(resolved.values().name(of_step.fields[2]), "u_next");
}

TEST(ValueIds, OfNoNameIsNowhere) {
  ValueIds ids;
  EXPECT_EQ(ids.find("t"), ValueIds::t);
  EXPECT_EQ(ids.find("dt"), ValueIds::dt);
  EXPECT_EQ(ids.find("u"), no_value);
  EXPECT_EQ(Places()[no_value], -1);
  const ProgramIds none;
  EXPECT_EQ(none.field(no_value), -1);
  EXPECT_EQ(none.derived(DPDE_LINK_FIELD, no_value), -1);
}

}  // namespace
}  // namespace dpde
