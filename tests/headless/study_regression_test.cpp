// Studies from the user's view: takt-run study --vary, killed in the middle and restarted, and as concurrent tasks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kRuns = 60;

class StudyRuns : public ::testing::Test {
 protected:
  std::vector<std::string> command(const std::vector<std::string>& more = {},
                                   const std::string& duration_s = "0.1") const {
    std::vector<std::string> words{TAKT_BIN_DIR "/takt-run",
                                   "study",
                                   TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml",
                                   "--vary",
                                   "contact.defaults.friction=0.1:0.4:" + std::to_string(kRuns),
                                   "--duration",
                                   duration_s,
                                   "--table",
                                   (directory_ / "study.csv").string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  fs::path runs() const { return directory_ / "study.csv.runs"; }
  /// Reports of runs that are done, with the time of each.
  std::map<std::string, fs::file_time_type> reports() const {
    std::map<std::string, fs::file_time_type> all;
    for (const auto& entry : fs::directory_iterator(runs()))
      if (entry.path().extension() == ".json" && entry.path().filename() != "study.json")
        all[entry.path().filename()] = entry.last_write_time();
    return all;
  }
  std::size_t count(const std::string& extension) const {
    std::size_t n = 0;
    for (const auto& entry : fs::directory_iterator(runs())) n += entry.path().extension() == extension;
    return n;
  }
  std::size_t rows() const {
    std::ifstream in(directory_ / "study.csv");
    return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
  }

  TemporaryDirectory directory_;
};

TEST_F(StudyRuns, AKilledStudyContinuesAtItsPlace) {
  {
    ChildProcess study(command({"--jobs", "2"}));
    ASSERT_TRUE(study.wait_for_output("3 of 60 runs")) << study.text;
    study.signal(SIGKILL);
    study.wait();
  }
  EXPECT_FALSE(fs::exists(directory_ / "study.csv"));
  const auto before = reports();
  ASSERT_GE(before.size(), 3U);
  ASSERT_LT(before.size(), static_cast<std::size_t>(kRuns)) << "it was too late to be killed in the middle";
  // One report is damaged meanwhile: that run is missing.
  const std::string damaged = before.begin()->first;
  fs::resize_file(runs() / damaged, fs::file_size(runs() / damaged) / 2);
  // As a study leaves it that is killed between the report of a run and the removal of its messages.
  std::ofstream(runs() / fs::path(before.rbegin()->first).replace_extension(".log")) << "message";

  ChildProcess again(command({"--jobs", "2"}));
  ASSERT_EQ(again.wait(), 0) << again.text;
  EXPECT_THAT(again.text, HasSubstr(std::to_string(before.size() - 1) + " of 60 runs were done before"));
  const auto after = reports();
  EXPECT_EQ(after.size(), static_cast<std::size_t>(kRuns));
  for (const auto& [name, time] : before) {
    if (name == damaged) continue;
    EXPECT_EQ(after.at(name), time) << name << " was done again";
  }
  EXPECT_EQ(rows(), 1U + kRuns);
  EXPECT_TRUE(fs::exists(directory_ / "study.svg"));
  std::ifstream in(directory_ / "study.html");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(page, HasSubstr("60 of 60 runs passed."));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_EQ(count(".part"), 0U);
  EXPECT_EQ(count(".log"), 0U);
}

TEST_F(StudyRuns, RunsEndWithTheirStudy) {
  ChildProcess study(command({"--jobs", "2"}, "1000"));
  // The first runs are under way when their messages have a file.
  while (!fs::exists(runs()) || count(".log") < 2) ASSERT_EQ(kill(study.pid(), 0), 0);
  const auto children = [&] {
    std::ifstream in("/proc/" + std::to_string(study.pid()) + "/task/" + std::to_string(study.pid()) +
                     "/children");
    std::vector<pid_t> pids;
    for (pid_t pid = 0; in >> pid;) pids.push_back(pid);
    return pids;
  }();
  ASSERT_EQ(children.size(), 2U);
  // A descriptor of each while it certainly lives: readable after its end, whichever process is its parent
  // then.
  std::vector<pollfd> ends;
  for (const pid_t pid : children) {
    const long descriptor = syscall(SYS_pidfd_open, pid, 0);
    ASSERT_GE(descriptor, 0) << std::strerror(errno);
    ends.push_back({static_cast<int>(descriptor), POLLIN, 0});
    EXPECT_EQ(poll(&ends.back(), 1, 0), 0) << "the run ended by itself";
  }
  study.signal(SIGKILL);
  study.wait();
  for (pollfd& end : ends) {
    EXPECT_EQ(poll(&end, 1, 300'000), 1) << "a run outlives its study";
    close(end.fd);
  }
}

TEST_F(StudyRuns, TasksBesideEachOtherShareTheRuns) {
  {
    ChildProcess even(command({"--task", "0/2", "--jobs", "1"})),
        odd(command({"--task", "1/2", "--jobs", "1"}));
    EXPECT_EQ(even.wait(), 0) << even.text;
    EXPECT_EQ(odd.wait(), 0) << odd.text;
  }
  EXPECT_EQ(reports().size(), static_cast<std::size_t>(kRuns));
  EXPECT_FALSE(fs::exists(directory_ / "study.csv"));
  ChildProcess table(command());
  EXPECT_EQ(table.wait(), 0);
  EXPECT_THAT(table.text, HasSubstr("60 of 60 runs were done before"));
  EXPECT_EQ(rows(), 1U + kRuns);
}

TEST_F(StudyRuns, ASecondStudyInTheSameDirectoryIsRefused) {
  ChildProcess first(command({"--jobs", "1"}));
  ASSERT_TRUE(first.wait_for_output("1 of 60 runs")) << first.text;
  ChildProcess second(command());
  EXPECT_EQ(second.wait(), 2);
  EXPECT_THAT(second.text, HasSubstr("another process is working on this study"));
}

TEST_F(StudyRuns, AStudyThatHasNoEndGivesWayToTheNext) {
  // The last of three values is refused.
  const auto study = [&](const std::string& vary) {
    return ChildProcess(
        {TAKT_BIN_DIR "/takt-run", "study", TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml", "--vary",
         vary, "--duration", "0.01", "--jobs", "1", "--table", (directory_ / "study.csv").string()});
  };
  ChildProcess wrong = study("contact.defaults.friction=0.2:-0.2:3");
  EXPECT_EQ(wrong.wait(), 2);
  EXPECT_THAT(wrong.text, HasSubstr("run 2 of the study (exit code 2)"));
  EXPECT_EQ(reports().size(), 2U);
  ChildProcess right = study("parts.Slab.twist.velocity_m_per_s[0]=0.5:1:2");
  EXPECT_EQ(right.wait(), 0) << right.text;
  EXPECT_EQ(rows(), 3U);
  EXPECT_EQ(reports().size(), 2U);
  ChildProcess other = study("contact.defaults.friction=0.1:0.2:2");
  EXPECT_EQ(other.wait(), 2);
  EXPECT_THAT(other.text, HasSubstr("holds the runs of another study"));
  // A key that no run has is refused before the directory is made.
  fs::remove_all(runs());
  ChildProcess unknown = study("contact.defaults.fricton=0.1:0.2:2");
  EXPECT_EQ(unknown.wait(), 2);
  EXPECT_THAT(unknown.text, HasSubstr("fricton"));
  EXPECT_FALSE(fs::exists(runs()));
}

TEST_F(StudyRuns, ANoteOfAllRunsIsPrintedOnce) {
  ChildProcess study({TAKT_BIN_DIR "/takt-run", "study",
                      TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml", "--vary",
                      "contact.defaults.friction=0.1:0.3:3", "--set", "parts.Slab.pose.position_m[2]=-0.008",
                      "--lod", "1", "--duration", "0.01", "--table", (directory_ / "study.csv").string()});
  EXPECT_EQ(study.wait(), 0) << study.text;
  const std::string note = "Slab starts inside Plate";
  const std::size_t first = study.text.find(note);
  ASSERT_NE(first, std::string::npos) << study.text;
  EXPECT_EQ(study.text.find(note, first + 1), std::string::npos) << study.text;
}

TEST_F(StudyRuns, TheSlurmJobIsTheSameStudy) {
  ChildProcess writer(command({"--slurm", (directory_ / "job").string()}));
  ASSERT_EQ(writer.wait(), 0) << writer.text;
  std::ifstream in(directory_ / "job/study.sbatch");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(text, HasSubstr("#SBATCH --array=0-59\n"));
  EXPECT_THAT(text, HasSubstr("--task \"$SLURM_ARRAY_TASK_ID/60\""));
  EXPECT_EQ(std::system(("sh -n '" + (directory_ / "job/study.sbatch").string() + "'").c_str()), 0);
  // A task as Slurm would start it.
  const std::string task =
      "SLURM_ARRAY_TASK_ID=59 sh '" + (directory_ / "job/study.sbatch").string() + "' 2>&1";
  ChildProcess run({"/bin/sh", "-c", task});
  EXPECT_EQ(run.wait(), 0) << run.text;
  EXPECT_EQ(reports().size(), 1U);
  EXPECT_EQ(reports().count("000059.json"), 1U);
}

}  // namespace
}  // namespace takt::test
