//! A study as a job array of Slurm, on a cluster of this machine alone.
//!
//! Where Slurm cannot be set up, the test says so and passes; what this project's own part does wrong fails.
#![cfg(unix)]

mod skipped;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = include_str!("../studies/mms/square.toml");
const STUDY: &str = r#"scene = "square.toml"
set = { "mesh.n" = 2, "time.step" = 0.125 }
vary = { "model.peclet" = [0.5, 1.0, 2.0] }
slurm = { time = "00:05:00", partition = "all", options = ["--comment=a study"] }
"#;

/// Whether a program is there.
fn is_there(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let more = ["/usr/sbin", "/sbin"].map(PathBuf::from);
    std::env::split_paths(&folders).chain(more).any(|folder| folder.join(program).is_file())
}

fn output_of(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Installs what is missing where that is possible.
fn install() -> Result<(), String> {
    const NEEDED: [&str; 5] = ["sbatch", "sinfo", "slurmctld", "slurmd", "munged"];
    if NEEDED.iter().all(|program| is_there(program)) {
        return Ok(());
    }
    if output_of("id", &["-u"]).as_deref() != Some("0") || !is_there("apt-get") {
        return Err("Slurm is not there, and only root can install it with apt-get".to_owned());
    }
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        command.env("DEBIAN_FRONTEND", "noninteractive").args(["-q", "-y"]).args(arguments);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    let packages = ["install", "--no-install-recommends", "slurm-wlm", "munge"];
    if apt(&packages) || (apt(&["update"]) && apt(&packages)) {
        Ok(())
    } else {
        Err("apt-get could not install slurm-wlm and munge".to_owned())
    }
}

/// Daemons of a cluster in a folder; they end with this.
struct Cluster {
    daemons: Vec<Child>,
    configuration: PathBuf,
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // the node before its controller, the controller before its keys
        for daemon in self.daemons.iter_mut().rev() {
            let _ = Command::new("kill").arg(daemon.id().to_string()).status();
            let begin = Instant::now();
            while begin.elapsed() < Duration::from_secs(10) && matches!(daemon.try_wait(), Ok(None)) {
                std::thread::sleep(Duration::from_millis(50));
            }
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

impl Cluster {
    /// One node, this machine, with its cores.
    fn start(folder: &Path) -> Result<Self, String> {
        if output_of("id", &["-u"]).as_deref() != Some("0") {
            return Err("the daemons of Slurm are started by root".to_owned());
        }
        let host = output_of("hostname", &["-s"]).ok_or("this machine has no name")?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let at = |name: &str| folder.join(name).display().to_string();
        let secret: String = (0..64).map(|k| char::from(b'a' + (k * 7 % 26))).collect();
        std::fs::write(at("key"), secret).map_err(|e| e.to_string())?;
        output_of("chmod", &["400", &at("key")]).ok_or("no chmod")?;
        for name in ["state", "spool"] {
            std::fs::create_dir(at(name)).map_err(|e| e.to_string())?;
        }
        let configuration = folder.join("slurm.conf");
        let port = 20_000 + std::process::id() % 20_000;
        let text = format!(
            "ClusterName=one\nSlurmctldHost={host}(127.0.0.1)\nSlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\n\
             AuthInfo=socket={}\nSlurmctldPort={port}\nSlurmdPort={}\nStateSaveLocation={}\nSlurmdSpoolDir={}\n\
             SlurmctldPidFile={}\nSlurmdPidFile={}\nProctrackType=proctrack/pgid\nTaskPlugin=task/none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU_Memory\nMpiDefault=none\n\
             JobAcctGatherType=jobacct_gather/none\nReturnToService=2\n\
             NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=1000 State=UNKNOWN\n\
             PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n",
            at("munge.socket"),
            port + 1,
            at("state"),
            at("spool"),
            at("slurmctld.pid"),
            at("slurmd.pid"),
        );
        std::fs::write(&configuration, text).map_err(|e| e.to_string())?;
        let mut cluster = Self { daemons: Vec::new(), configuration };
        let munge: Vec<String> = [
            "key-file=key",
            "socket=munge.socket",
            "pid-file=munged.pid",
            "log-file=munged.log",
            "seed-file=munged.seed",
        ]
        .iter()
        .filter_map(|option| option.split_once('='))
        .map(|(option, file)| format!("--{option}={}", at(file)))
        .chain(["--foreground", "--force"].map(str::to_owned))
        .collect();
        cluster.daemon("munged", &munge)?;
        cluster.wait_for("munged", || folder.join("munge.socket").exists())?;
        cluster.daemon("slurmctld", &["-D".to_owned()])?;
        cluster.daemon("slurmd", &["-D".to_owned(), "-N".to_owned(), host])?;
        let configuration = cluster.configuration.clone();
        cluster.wait_for("slurmd", || {
            let states = Command::new("sinfo").args(["-h", "-o", "%t"]).env("SLURM_CONF", &configuration).output();
            states.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == "idle")
        })?;
        Ok(cluster)
    }

    fn daemon(&mut self, program: &str, arguments: &[String]) -> Result<(), String> {
        let path = std::env::var("PATH").unwrap_or_default() + ":/usr/sbin:/sbin";
        let mut command = Command::new("env");
        command.arg(format!("PATH={path}")).arg(format!("SLURM_CONF={}", self.configuration.display()));
        command.arg(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        self.daemons.push(command.spawn().map_err(|e| format!("{program}: {e}"))?);
        Ok(())
    }

    fn wait_for(&mut self, what: &str, ready: impl Fn() -> bool) -> Result<(), String> {
        let begin = Instant::now();
        while !ready() {
            let ended = self.daemons.last_mut().is_some_and(|daemon| !matches!(daemon.try_wait(), Ok(None)));
            if ended || begin.elapsed() > Duration::from_secs(30) {
                return Err(format!("{what} does not come up"));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(())
    }
}

fn monolayer(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_monolayer"));
    command.arg("study").args(arguments).current_dir(folder);
    command
}

/// The table without what it cost.
fn table(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let kept = reader.headers().unwrap().len() - 3;
    reader.records().map(|row| row.unwrap().iter().take(kept).map(str::to_owned).collect()).collect()
}

fn with_study() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("square.toml"), SCENE.replace("end = 1.0", "end = 0.25")).unwrap();
    std::fs::write(root.path().join("array.toml"), STUDY).unwrap();
    root
}

#[test]
fn the_scripts_say_what_is_needed() {
    let root = with_study();
    let arguments =
        ["array.toml", "--launcher", "slurm", "--dry-run", "--shards", "2", "--threads", "1", "--out", "an out"];
    let output = monolayer(root.path(), &[&arguments[..], &["--set", "time.step=0.25"]].concat()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let script = std::fs::read_to_string(root.path().join("an out/slurm.sh")).unwrap();
    for line in ["--array=1-2", "--cpus-per-task=1", "--time=00:05:00", "--partition=all", "--comment=\"a study\""] {
        assert!(script.contains(&format!("#SBATCH {line}\n")), "no {line} in\n{script}");
    }
    let memory =
        script.lines().find_map(|line| line.strip_prefix("#SBATCH --mem=")?.strip_suffix('M')?.parse::<usize>().ok());
    assert!(memory.is_some_and(|mib| (65..400).contains(&mib)), "{script}");
    // a task is what the shell makes of its last line
    let task = format!("SLURM_ARRAY_TASK_ID=2 sh '{}'", root.path().join("an out/slurm.sh").display());
    assert!(
        Command::new("sh").args(["-c", &task]).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
    );
    let rows = table(&root.path().join("an out/results.2-of-2.csv"));
    assert_eq!((rows.len(), rows[0][0].as_str()), (1, "02"));
    assert!(
        rows[0].contains(&"0.25".to_owned()) && rows[0][8] == "1",
        "one step, for the override is handed on: {rows:?}"
    );
    let lost = monolayer(
        root.path(),
        &["array.toml", "--launcher", "slurm", "--dry-run", "--out", "b", "--set", "coupling={ kind = \"newton\" }"],
    );
    let error = { lost }.output().unwrap();
    assert!(String::from_utf8_lossy(&error.stderr).contains("cannot be handed on to the jobs"));
    let local = monolayer(root.path(), &["array.toml", "--dry-run"]).output().unwrap();
    assert!(String::from_utf8_lossy(&local.stderr).contains("add `--launcher slurm`"));
}

#[test]
fn a_job_array_makes_the_table_of_a_plain_study() {
    let root = with_study();
    if let Err(reason) = install() {
        skipped::skip("a_job_array_makes_the_table_of_a_plain_study", &reason);
        return;
    }
    let daemons = tempfile::tempdir().unwrap();
    let cluster = match Cluster::start(daemons.path()) {
        Ok(cluster) => cluster,
        Err(reason) => {
            skipped::skip("a_job_array_makes_the_table_of_a_plain_study", &reason);
            return;
        }
    };
    let mut command = monolayer(root.path(), &["array.toml", "--launcher", "slurm", "--threads", "1", "--out", "jobs"]);
    let output = command.env("SLURM_CONF", &cluster.configuration).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("with 3 tasks"), "{said}");
    let results = root.path().join("jobs/results.csv");
    let begin = Instant::now();
    while !results.exists() {
        if begin.elapsed() > Duration::from_secs(120) {
            let queue = Command::new("squeue").env("SLURM_CONF", &cluster.configuration).output().unwrap();
            let log = std::fs::read_to_string(root.path().join("jobs/slurm/1.log")).unwrap_or_default();
            panic!("the jobs do not end: {}\n{log}", String::from_utf8_lossy(&queue.stdout));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(monolayer(root.path(), &["array.toml", "-q", "--out", "plain"]).status().unwrap().success());
    let rows = table(&results);
    assert_eq!(rows.len(), 3);
    assert_eq!(rows, table(&root.path().join("plain/results.csv")));
    assert!(monolayer(root.path(), &["-q", "--gather", "jobs"]).status().unwrap().success());
    assert_eq!(table(&results), rows);
}
