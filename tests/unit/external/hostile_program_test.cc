// Programs of users that fail in every way that they have.  Real processes; time is passed in.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/base/clock.h"
#include "common/external/simulator.h"

namespace gapfarm::hostile_program_test {

using testing::AllOf;
using testing::HasSubstr;

// Every look at it is a hundred seconds later.
double leaping_clock() {
  static thread_local double now_s = 0;
  return now_s += 100;
}

std::vector<std::string> shell(const std::string& script) { return {"sh", "-c", script}; }

std::string error_of(const std::string& script, const std::string& line = "question",
                     LineLimits limits = {}) {
  LineProgram program(shell(script), "", limits, monotonic_seconds);
  const auto answer = program.ask(line);
  EXPECT_FALSE(answer.ok());
  EXPECT_FALSE(program.running());
  return answer ? "" : answer.error().message;
}

TEST(LineProgram, AnswersLineByLineInItsFolder) {
  LineProgram program(shell("while read x; do echo \"$x at $(pwd)\"; done"), "/", {},
                      monotonic_seconds);
  EXPECT_FALSE(program.running());
  EXPECT_EQ(program.ask("one").value(), "one at /");
  EXPECT_EQ(program.ask("two").value(), "two at /");
  EXPECT_TRUE(program.running());
}

TEST(LineProgram, NamesOneThatCannotBeStarted) {
  LineProgram missing({"/no/such/program"}, "", {}, monotonic_seconds);
  EXPECT_THAT(missing.ask("x").error().message,
              AllOf(HasSubstr("/no/such/program"), HasSubstr("No such file")));
  LineProgram nowhere(shell("cat"), "/no/such/folder", {}, monotonic_seconds);
  EXPECT_THAT(nowhere.ask("x").error().message,
              HasSubstr("cannot be started in '/no/such/folder'"));
}

TEST(LineProgram, NamesHowOneEnded) {
  EXPECT_THAT(error_of("read x; kill -SEGV $$"), HasSubstr("crashed with signal 11"));
  EXPECT_THAT(error_of("read x; exit 3"), HasSubstr("ended with status 3"));
  EXPECT_THAT(error_of("exit 4"), HasSubstr("ended with status 4"));
}

TEST(LineProgram, StartsAgainAfterAFailure) {
  LineProgram program(shell("read x; [ $x = bad ] && exit 1; echo fine; read x"), "", {},
                      monotonic_seconds);
  EXPECT_FALSE(program.ask("bad").ok());
  EXPECT_EQ(program.ask("good").value(), "fine");
}

TEST(LineProgram, DoesNotWaitForEver) {
  LineProgram silent(shell("while read x; do :; done"), "", {}, leaping_clock);
  EXPECT_THAT(silent.ask("x").error().message, HasSubstr("did not answer within 60 s"));
  // One that does not even read.
  LineProgram deaf(shell("exec sleep 1000"), "", {}, leaping_clock);
  EXPECT_THAT(deaf.ask(std::string(10'000'000, 'x')).error().message,
              HasSubstr("does not read what it is asked"));
}

TEST(LineProgram, TakesNoEndlessLineAndNothingUnasked) {
  LineLimits limits;
  limits.answer_bytes = 1000;
  EXPECT_THAT(error_of("read x; yes | tr -d '\\n'", "question", limits),
              AllOf(HasSubstr("more than the 1000 bytes"), HasSubstr("'yyyy")));
  LineProgram twice(shell("while read x; do printf 'one\\ntwo\\n'; done"), "", {},
                    monotonic_seconds);
  EXPECT_EQ(twice.ask("x").value(), "one");
  EXPECT_THAT(twice.ask("x").error().message, HasSubstr("answered twice, or late: 'two"));
}

TEST(LineProgram, EndsWithItsOwner) {
  pid_t pid = 0;
  {
    LineProgram program(shell("read x; echo $$; read x"), "", {}, monotonic_seconds);
    pid = std::stoi(program.ask("who").value());
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

// Readable at its end: all that had it as their output are gone.
std::string rest_of(int fd) {
  std::string text;
  char bytes[256];
  for (ssize_t n = 0; (n = read(fd, bytes, sizeof bytes)) > 0;) {
    text.append(bytes, static_cast<std::size_t>(n));
  }
  return text;
}

// A wrapper that starts the program proper, which holds descriptor 9 as long as it lives.
std::string wrapping(int fd) {
  return "exec 9>/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(fd) +
         "; (while :; do sleep 1000; done) & read x; echo answer; read x";
}

TEST(LineProgram, TakesWhatItStartedWithIt) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  {
    LineProgram program(shell(wrapping(ends[1])), "", {}, monotonic_seconds);
    EXPECT_EQ(program.ask("x").value(), "answer");
    close(ends[1]);
  }
  EXPECT_EQ(rest_of(ends[0]), "");
  close(ends[0]);
}

TEST(LineProgram, TakesWhatItStartedWithItWhenItsOwnerIsKilled) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  const pid_t owner = fork();
  if (owner == 0) {
    LineProgram program(shell(wrapping(ends[1])), "", {}, monotonic_seconds);
    if (program.ask("x").ok()) ::kill(getpid(), SIGKILL);
    _exit(1);
  }
  close(ends[1]);
  int status = 0;
  ASSERT_EQ(waitpid(owner, &status, 0), owner);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(rest_of(ends[0]), "");
  close(ends[0]);
}

TEST(LineProgram, NamesHowOneEndedWhoseChildHasItsOutput) {
  LineProgram program(shell("sleep 1000 & exit 3"), "", {0.2, 0.2}, monotonic_seconds);
  EXPECT_THAT(program.ask("x").error().message, HasSubstr("ended with status 3"));
}

// A program that introduces itself well and then answers with `answer`.
Result<ExternalAnswer> answered(const std::string& answer, double interval_s = 0) {
  const std::string hello = R"({"gapfarm":1,"inputs":["path"]})";
  ExternalSimulator simulator(
      {shell("read x; echo '" + hello + "'; while read x; do echo '" + answer + "'; done"), "", 60},
      monotonic_seconds);
  const ExternalDeclaration declaration = parse_declaration(hello).value();
  ExternalRequest request;
  request.declaration = &declaration;
  request.interval_s = interval_s;
  return simulator.simulate(request, hello);
}

TEST(ExternalSimulator, NamesAnswersThatAreNone) {
  const auto message = [](const std::string& answer, double interval_s = 0) {
    const auto result = answered(answer, interval_s);
    EXPECT_FALSE(result.ok()) << answer;
    return result ? "" : result.error().message;
  };
  EXPECT_TRUE(answered(R"({"id": 1, "pose": [1, 2, 0.5]})").ok());
  EXPECT_THAT(message("rubbish"), HasSubstr("did not answer with a JSON object: 'rubbish'"));
  EXPECT_THAT(message(R"({"id": 2, "pose": [0, 0, 0]})"), HasSubstr("another question than 1"));
  EXPECT_THAT(message(R"({"id": 1, "pose": [0, 0]})"), HasSubstr("[x, y, theta]"));
  EXPECT_THAT(message(R"({"id": 1, "pose": [0, 1e999, 0]})"), HasSubstr("JSON object"));
  for (const char* number : {"NaN", "-Infinity"}) {  // as Python's json prints them
    EXPECT_THAT(
        message(R"({"id": 1, "pose": [0, )" + std::string(number) + ", 0]}"),
        AllOf(HasSubstr(std::string(number) + ", which is no number"), HasSubstr("print null")));
  }
  EXPECT_THAT(message(R"({"id": 1, "pose": [0, 0, 0]})", 0.1), HasSubstr("answered none"));
  for (const char* far : {R"({"id": 1, "pose": [0, -1e300, 0]})",
                          R"({"id": 1, "pose": [0, 0, 0], "path": [[0, 10001, 0, 0]]})"}) {
    EXPECT_THAT(message(far, 0.1),
                AllOf(HasSubstr("external program '"), HasSubstr("expected one in [-10000, 10000]"),
                      HasSubstr("by hand: ")));
  }
  EXPECT_THAT(message(R"({"id": 1, "outcome": "tired"})"), HasSubstr("other than ok or diverged"));
}

TEST(ExternalSimulator, ADivergedSimulationIsAnAnswer) {
  for (const char* answer : {R"({"id": 1, "outcome": "diverged", "message": "NaN"})",
                             R"({"id": 1, "pose": null})", R"({"id": 1, "pose": [0, null, 0]})"}) {
    const auto result = answered(answer);
    ASSERT_TRUE(result.ok()) << answer;
    EXPECT_TRUE(result->diverged) << answer;
  }
}

// The second line of an error asks a new program the same, also where words need quoting.
TEST(ExternalSimulator, AFailureCanBeRepeatedByHand) {
  const std::string hello = R"({"gapfarm":1,"name":"it's me"})";
  ExternalSimulator simulator(
      {shell("read x; echo '{\"gapfarm\":1,\"name\":\"it'\\''s me\"}'; read x; echo \"bang $x\""),
       "/", 60},
      monotonic_seconds);
  const auto declaration = parse_declaration(hello);
  ASSERT_TRUE(declaration.ok());
  ExternalRequest request;
  request.declaration = &*declaration;
  const auto result = simulator.simulate(request, hello);
  ASSERT_FALSE(result.ok());
  const std::string& message = result.error().message;
  const std::string begin = "\nby hand: ";
  ASSERT_THAT(message, HasSubstr(begin));
  const std::string command = message.substr(message.find(begin) + begin.size());
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  for (int c = 0; (c = std::fgetc(pipe)) != EOF;) output += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << command;
  EXPECT_EQ(output, hello + "\nbang " + request_line(request) + "\n");
}

TEST(ExternalSimulator, RefusesOneThatDeclaresSomethingElseThanBefore) {
  ExternalSimulator simulator({shell("read x; echo '{\"gapfarm\":1}'; read x"), "", 60},
                              monotonic_seconds);
  const ExternalDeclaration declaration;
  ExternalRequest request;
  request.declaration = &declaration;
  const auto result = simulator.simulate(request, R"({"gapfarm":1,"name":"other"})");
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().message, HasSubstr("declares other things"));
}

}  // namespace gapfarm::hostile_program_test
