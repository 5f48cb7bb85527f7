# A Slurm of its own for tests/schedulers/run, which reads this file: a controller and two nodes, n1 and n2, of one core each, all on
# this machine. Everything is in the folder $slurm; whatever Slurm starts has SLURM_CONF in its environment.

slurm_start() {
    export SLURM_CONF=$slurm/slurm.conf
    mkdir -p "$slurm"/{state,munge}
    local host ports
    host=$(hostname -s)
    # free ones: controller, nodes
    ports=($(python3 -c 'import socket
sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(3)]
print(*(s.getsockname()[1] for s in sockets))'))
    # cred_expire is also the time that a requeued task waits
    cat >"$SLURM_CONF" <<CONF
ClusterName=percuss
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports[0]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$slurm/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool.%n
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/%n.pid
SlurmctldLogFile=$slurm/slurmctld.log
SlurmdLogFile=$slurm/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=1,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[1]} CPUs=1 RealMemory=1000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[2]} CPUs=1 RealMemory=1000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    head -c 1024 /dev/urandom >"$slurm/munge/key"
    chmod 400 "$slurm/munge/key"
    chown -R munge "$slurm/munge"
    setpriv --reuid munge --regid munge --clear-groups munged --force --key-file="$slurm/munge/key" \
        --socket="$slurm/munge/socket" --pid-file="$slurm/munge/pid" --log-file="$slurm/munge/log" --seed-file="$slurm/munge/seed"
    slurmctld
    slurmd -N n1
    slurmd -N n2
    wait_for 30 'two idle nodes' eval 'test "$(sinfo -h -N -t idle -o %N | wc -l)" -eq 2'
}

# The processes of tasks on a node, after those of Slurm that watch them.
slurm_tasks() {
    local environment status tasks=() watchers=()
    while read -r environment; do
        grep -qszxF "SLURMD_NODENAME=$1" "$environment" || continue
        status=$(cat "${environment%environ}status" 2>/dev/null) || continue
        tasks+=("$(awk '/^Pid:/ { print $2 }' <<<"$status")")
        watchers+=("$(awk '/^PPid:/ { print $2 }' <<<"$status")")
    done < <(grep -slzxF "SLURM_CONF=$SLURM_CONF" /proc/[0-9]*/environ)
    for watcher in "${watchers[@]}"; do
        if grep -qsx slurmstepd "/proc/$watcher/comm"; then echo "$watcher"; fi
    done
    printf '%s\n' "${tasks[@]}"
}

# Ends a node and all that runs on it at once, as a failure of its power does; afterwards it may be started again.
slurm_crash() {
    kill -9 "$(cat "$slurm/$1.pid")"
    slurm_tasks "$1" | xargs -r kill -9
}

# Ends all daemons and tasks.
slurm_stop() {
    local node daemon
    for node in n1 n2; do
        if [ -e "$slurm/$node.pid" ]; then slurm_crash "$node"; fi
    done
    for daemon in slurmctld.pid munge/pid; do
        if [ -e "$slurm/$daemon" ]; then kill -9 "$(cat "$slurm/$daemon")"; fi
    done
}
