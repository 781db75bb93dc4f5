#include "system/program_output.h"

#include <gtest/gtest.h>

namespace ruedo {
namespace {

TEST(ProgramOutput, IsTheProgramsStandardOutput) {
  EXPECT_EQ(output_of({"/bin/echo", "a b", "c"}, ItsErrors::shown), "a b c\n");
  EXPECT_EQ(output_of({"/bin/sh", "-c", "echo out; echo error >&2"}, ItsErrors::dropped), "out\n");
}

TEST(ProgramOutput, IsCompleteWhenLong) {  // longer than a pipe holds
  const auto text = output_of({"/bin/sh", "-c", "yes | head -c 300000"}, ItsErrors::shown);
  ASSERT_TRUE(text);
  EXPECT_EQ(text->size(), 300000u);
}

TEST(ProgramOutput, IsMissingForAProgramThatFailsOrIsNotThere) {
  EXPECT_EQ(output_of({"/bin/false"}, ItsErrors::shown), std::nullopt);
  EXPECT_EQ(output_of({"/bin/sh", "-c", "echo out; kill -9 $$"}, ItsErrors::shown), std::nullopt);
  EXPECT_EQ(output_of({"/there/is/no/such/program"}, ItsErrors::shown), std::nullopt);
}

}  // namespace
}  // namespace ruedo
