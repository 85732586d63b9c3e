// takt record, export and plot with a missing requirement: the cell, its server, room for the output,
// gnuplot.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>

#include "client_lib/client.h"
#include "client_lib/recording/mcap_reader.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::test::ChildProcess;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::kBin;
using takt::test::kGenerous;

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// takt with this test's cell and domain.
std::vector<std::string> takt_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {kBin + "/takt", "--cell", takt::test::test_cell(), "--domain",
                                       std::to_string(takt::test::test_domain())});
  return arguments;
}

std::size_t count_of(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

/// Tests at most once for each status of the cell.
bool comes_true(const Client& client, const std::function<bool()>& condition) {
  for (int i = 0; i < 600; ++i) {
    if (condition()) return true;
    (void)client.wait_for(
        takt::topics::status,
        [n = client.status().sample_number](const auto& s) { return s.sample_number > n; }, kGenerous);
  }
  return condition();
}

std::size_t descriptions_in(const std::filesystem::path& recording) {
  std::size_t count = 0;
  try {
    takt::recording::McapReader reader(recording);
    reader.read([&](const takt::recording::McapMessage& message) {
      if (message.channel->type == "takt_msgs/msg/CellDescription") ++count;
      return true;
    });
  } catch (const takt::recording::RecordingError&) {  // the file is still missing
  }
  return count;
}

class RecordedServer : public testing::Test {
 protected:
  std::unique_ptr<ChildProcess> server() const {
    auto program = std::make_unique<ChildProcess>(
        std::vector<std::string>{kBin + "/takt-server", scenario_.string(), "--cell", takt::test::test_cell(),
                                 "--domain", std::to_string(takt::test::test_domain())});
    EXPECT_TRUE(program->wait_for_output("ready")) << program->text;
    return program;
  }

  const takt::test::TemporaryDirectory directory_;
  const std::filesystem::path scenario_ =
      (directory_.write("two_robots.yaml", takt::test::service_scenario_text()),
       directory_ / "two_robots.yaml");
};

TEST_F(RecordedServer, AMissingServerLeavesFilesUnchanged) {
  for (const std::string name : {"run.mcap", "run.jsonl", "run.csv"}) {
    directory_.write(name, "what was recorded before");
    std::vector<std::string> arguments{"record", (directory_ / name).string(), "--timeout", "0.5"};
    if (name.ends_with("jsonl")) arguments.push_back("--json");
    ChildProcess record(takt_command(arguments));
    EXPECT_EQ(record.wait(), 3) << name << ": " << record.text;
    EXPECT_EQ(bytes_of(directory_ / name), "what was recorded before") << name;
  }
}

TEST_F(RecordedServer, ARecordingWithAnEndEndsWhenTheServerDies) {
  const auto program = server();
  const Client client(client_options());
  const auto mcap = directory_ / "run.mcap", lines = directory_ / "run.jsonl", table = directory_ / "run.csv";
  ChildProcess record_mcap(takt_command({"record", mcap.string(), "--until", "10000"}));
  ChildProcess record_lines(takt_command({"record", lines.string(), "--json", "--duration", "10000"}));
  ChildProcess record_table(takt_command({"record", table.string(), "--until", "10000"}));
  EXPECT_TRUE(comes_true(client, [&] { return descriptions_in(mcap) == 1; }));
  EXPECT_TRUE(comes_true(client, [&] { return count_of(bytes_of(lines), "\"kind\":\"state\"") > 0; }));
  EXPECT_TRUE(comes_true(client, [&] { return count_of(bytes_of(table), "\n") > 1; }));
  program->signal(SIGKILL);
  for (ChildProcess* record : {&record_mcap, &record_lines, &record_table})
    EXPECT_EQ(record->wait(), 3) << record->text;
  expect_words(record_lines.text, {"\"kind\":\"lost\""});
  expect_words(bytes_of(lines), {"\"kind\":\"end\""});
  EXPECT_EQ(takt::recording::McapReader(mcap).cut_off(), "");
}

TEST_F(RecordedServer, ARecordingWithoutAnEndWaitsForADeadServer) {
  auto program = server();
  const auto mcap = directory_ / "run.mcap", lines = directory_ / "run.jsonl";
  ChildProcess record_mcap(takt_command({"record", mcap.string()}));
  ChildProcess record_lines(takt_command({"record", lines.string(), "--json"}));
  {
    const Client client(client_options());
    EXPECT_TRUE(comes_true(client, [&] { return descriptions_in(mcap) == 1; }));
    EXPECT_TRUE(comes_true(client, [&] { return count_of(bytes_of(lines), "\"kind\":\"state\"") > 0; }));
  }
  program->signal(SIGKILL);
  EXPECT_TRUE(record_mcap.wait_for_output("waiting for it")) << record_mcap.text;
  EXPECT_TRUE(record_lines.wait_for_output("waiting for it")) << record_lines.text;
  const std::size_t before = count_of(bytes_of(lines), "\"kind\":\"state\"");
  program = server();
  const Client client(client_options());
  EXPECT_TRUE(comes_true(client, [&] { return descriptions_in(mcap) == 2; }));
  EXPECT_TRUE(comes_true(client, [&] { return count_of(bytes_of(lines), "\"kind\":\"state\"") > before; }));
  for (ChildProcess* record : {&record_mcap, &record_lines}) {
    record->signal(SIGINT);
    EXPECT_EQ(record->wait(), 0) << record->text;
    EXPECT_EQ(count_of(record->text, "waiting for it"), 1U) << record->text;
  }
}

TEST(TaktRecord, ATableCutShortIsAFailure) {
  HostedService service;
  Client client(client_options());
  client.step(10);
  ChildProcess bounded(takt_command({"record", "-", "--until", "8"}));
  ChildProcess unbounded(takt_command({"record", "-"}));
  ASSERT_TRUE(bounded.wait_for_output("\n0.0")) << bounded.text;
  ASSERT_TRUE(unbounded.wait_for_output("\n0.0")) << unbounded.text;
  client.reset();
  EXPECT_EQ(bounded.wait(), 1) << bounded.text;
  expect_words(bounded.text, {"reset"});
  EXPECT_EQ(unbounded.wait(), 0) << unbounded.text;
}

/// A short recording made by takt-run.
class RecordingFile : public testing::Test {
 protected:
  RecordingFile() {
    directory_.write("two_robots.yaml", takt::test::service_scenario_text());
    ChildProcess run({kBin + "/takt-run", "run", (directory_ / "two_robots.yaml").string(), "--duration",
                      "0.2", "--quiet", "--mcap", file_.string()});
    EXPECT_EQ(run.wait(), 0) << run.text;
  }
  /// Through a shell, with `redirection`: the text of all output and the exit code.
  static std::pair<int, std::string> shell(const std::vector<std::string>& command,
                                           const std::string& redirection) {
    std::string line;
    for (const std::string& word : command) line += "'" + word + "' ";
    ChildProcess program({"/bin/bash", "-c", "set -o pipefail; " + line + redirection});
    const int code = program.wait();
    return {code, program.text};
  }

  const takt::test::TemporaryDirectory directory_;
  const std::filesystem::path file_ = directory_ / "run.mcap";
};

TEST_F(RecordingFile, LostOutputIsAFailure) {
  const std::string scenario = (directory_ / "two_robots.yaml").string();
  for (const auto& command : std::vector<std::vector<std::string>>{
           takt_command({"export", file_.string(), "--json"}),
           takt_command({"export", file_.string(), "--csv", "-"}),
           takt_command({"export", file_.string(), "--list"}),
           takt_command({"--help"}),
           {kBin + "/takt-run", "run", scenario, "--duration", "0.01", "--json"},
           {kBin + "/takt-run", "run", scenario, "--duration", "0.01"}}) {
    const auto [code, text] = shell(command, ">/dev/full");
    EXPECT_EQ(code, 1) << command[1] << ": " << text;
    expect_words(text, {"Standard output cannot be written on"});
    EXPECT_EQ(shell(command, ">/dev/null").first, 0) << command[1];
  }
  HostedService service;
  const auto [code, text] = shell(takt_command({"state", "--json"}), ">/dev/full");
  EXPECT_EQ(code, 1) << text;
}

TEST_F(RecordingFile, AClosedPipeEndsTheExportSilently) {
  for (const std::vector<std::string>& command : {takt_command({"export", file_.string(), "--json"}),
                                                  takt_command({"export", file_.string(), "--csv", "-"})}) {
    EXPECT_EQ(count_of(shell(command, "| true").second, "cannot be written"), 0U);
    // For programs to which only the error reports it.
    EXPECT_EQ(count_of(shell({"trap", "", "PIPE"},
                             "; " + command[0] + " export " + file_.string() + " --json | true")
                           .second,
                       "cannot be written"),
              0U);
  }
}

TEST_F(RecordingFile, AnExistingFileIsNotOverwritten) {
  const std::string before = bytes_of(file_);
  const auto link = directory_ / "link.png";
  std::filesystem::create_symlink(file_, link);
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"export", file_.string(), "--csv", file_.string()},
                                             {"export", file_.string(), "--csv", link.string()},
                                             {"plot", file_.string(), "state.*", "-o", link.string()}}) {
    ChildProcess program(takt_command(arguments));
    EXPECT_EQ(program.wait(), 1) << program.text;
    expect_words(program.text, {"is the recording itself"});
    EXPECT_EQ(bytes_of(file_), before);
  }
  ChildProcess other(takt_command({"export", file_.string(), "--csv", (directory_ / "run.csv").string()}));
  EXPECT_EQ(other.wait(), 0) << other.text;
}

TEST_F(RecordingFile, APlotWithoutGnuplotOrFolderIsRefused) {
  std::vector<std::string> command = takt_command({"plot", file_.string(), "state.robots.Robot1.*", "-o"});
  command.insert(command.begin(), {"/usr/bin/env", "PATH=" + directory_.path().string()});
  command.push_back((directory_ / "run.svg").string());
  ChildProcess nobody(command);
  EXPECT_EQ(nobody.wait(), 1) << nobody.text;
  expect_words(nobody.text, {"takt: gnuplot", "not installed", "gnuplot-nox"});
  command.back() = (directory_ / "no_such_folder" / "run.svg").string();
  ChildProcess nowhere(command);
  EXPECT_EQ(nowhere.wait(), 1) << nowhere.text;
  expect_words(nowhere.text, {"takt: The folder", "no_such_folder", "is not there"});
}

}  // namespace
