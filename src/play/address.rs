//! How a receiver is named on the command line.

use std::str::FromStr;

use crate::diag::nearest;

/// Where commands go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// `stdout`.
    Stdout,
    /// `stdio`: poses in, commands out, time by the poses.
    Stdio,
    /// `udp://HOST:PORT`.
    Udp {
        /// `HOST:PORT`.
        to: String,
    },
    /// `can:IFACE`: a CAN interface of the system.
    Can {
        /// Its name.
        interface: String,
    },
    /// `can:udp://HOST:PORT[?local=PORT]`: CAN frames in UDP, as cannelloni has them.
    CanOverUdp {
        /// `HOST:PORT`.
        to: String,
        /// Port on which the answers come in.
        local: u16,
    },
    /// `foxglove[://HOST:PORT]`.
    Foxglove {
        /// Where to listen.
        host: String,
        /// Port.
        port: u16,
    },
    /// `ros2`: DDS.
    Ros2,
    /// `zenoh[:ENDPOINT]`.
    Zenoh {
        /// Zenoh's name of the router, such as `tcp/localhost:7447`.
        endpoint: String,
    },
}

/// Foxglove's own port.
const FOXGLOVE_PORT: u16 = 8765;
/// Where rmw_zenohd listens.
const ROUTER: &str = "tcp/localhost:7447";

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            let scheme = text.split(':').next().unwrap_or_default();
            let near = nearest(scheme, ["stdout", "stdio", "udp", "can", "ros2", "zenoh", "foxglove"]);
            Err(format!(
                "no sink `{text}`; there are stdout, stdio, udp://HOST:PORT, can:IFACE, can:udp://HOST:PORT, ros2, zenoh[:ENDPOINT] and \
                 foxglove[://HOST:PORT], such as {}",
                near.unwrap_or("stdout")
            ))
        };
        if let Some(bus) = text.strip_prefix("can:") {
            return match bus.strip_prefix("udp://") {
                Some(rest) => can_over_udp(rest),
                None if !bus.is_empty() && !bus.contains(['/', ':', ' ']) => {
                    Ok(Self::Can { interface: bus.to_owned() })
                }
                None => unknown(),
            };
        }
        if let Some(to) = text.strip_prefix("udp://") {
            host_and_port(to)?;
            return Ok(Self::Udp { to: to.to_owned() });
        }
        if let Some(to) = text.strip_prefix("foxglove://") {
            let (host, port) = host_and_port(to)?;
            return Ok(Self::Foxglove { host: host.to_owned(), port });
        }
        if let Some(endpoint) = text.strip_prefix("zenoh:") {
            return match endpoint.split_once('/') {
                Some((_, rest)) if !rest.is_empty() => Ok(Self::Zenoh { endpoint: endpoint.to_owned() }),
                _ => Err(format!("`{endpoint}` is no Zenoh endpoint, such as {ROUTER}")),
            };
        }
        match text {
            "stdout" => Ok(Self::Stdout),
            "stdio" => Ok(Self::Stdio),
            "ros2" => Ok(Self::Ros2),
            "zenoh" => Ok(Self::Zenoh { endpoint: ROUTER.to_owned() }),
            "foxglove" => Ok(Self::Foxglove { host: "127.0.0.1".to_owned(), port: FOXGLOVE_PORT }),
            _ => unknown(),
        }
    }
}

fn can_over_udp(rest: &str) -> Result<Address, String> {
    let (to, local) = match rest.split_once("?local=") {
        None => (rest, None),
        Some((to, local)) => (to, Some(local)),
    };
    let (_, port) = host_and_port(to)?;
    let local = match local {
        None => port.wrapping_add(1),
        Some(local) => local.parse().map_err(|_| format!("`{local}` is no port"))?,
    };
    Ok(Address::CanOverUdp { to: to.to_owned(), local })
}

fn host_and_port(text: &str) -> Result<(&str, u16), String> {
    let parts = text.rsplit_once(':').filter(|(host, _)| !host.is_empty());
    let port = parts.and_then(|(host, port)| Some((host, port.parse().ok().filter(|port| *port > 0)?)));
    port.ok_or_else(|| format!("`{text}` is not HOST:PORT, such as 127.0.0.1:9870"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Address {
        text.parse().unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn every_kind_of_sink_is_named_by_its_address() {
        assert_eq!(parse("stdout"), Address::Stdout);
        assert_eq!(parse("stdio"), Address::Stdio);
        assert_eq!(parse("udp://robot.local:9870"), Address::Udp { to: "robot.local:9870".into() });
        assert_eq!(parse("udp://[::1]:9870"), Address::Udp { to: "[::1]:9870".into() });
        assert_eq!(parse("can:can0"), Address::Can { interface: "can0".into() });
        let over = |local| Address::CanOverUdp { to: "127.0.0.1:20000".into(), local };
        assert_eq!(parse("can:udp://127.0.0.1:20000"), over(20001));
        assert_eq!(parse("can:udp://127.0.0.1:20000?local=20000"), over(20000));
        assert_eq!(parse("foxglove"), Address::Foxglove { host: "127.0.0.1".into(), port: 8765 });
        assert_eq!(parse("foxglove://0.0.0.0:9000"), Address::Foxglove { host: "0.0.0.0".into(), port: 9000 });
        assert_eq!(parse("ros2"), Address::Ros2);
        assert_eq!(parse("zenoh"), Address::Zenoh { endpoint: "tcp/localhost:7447".into() });
        assert_eq!(parse("zenoh:tcp/10.0.0.2:7447"), Address::Zenoh { endpoint: "tcp/10.0.0.2:7447".into() });
    }

    #[test]
    fn what_names_no_sink_is_refused_with_what_there_is() {
        for wrong in [
            "",
            "std",
            "udp:localhost:1",
            "udp://localhost",
            "udp://:9",
            "udp://a:99999",
            "udp://a:0",
            "can:",
            "can:a b",
            "can:udp://a",
            "can:udp://a:1?local=x",
            "zenoh:",
            "zenoh:tcp",
            "foxglove://a",
        ] {
            assert!(wrong.parse::<Address>().is_err(), "{wrong}");
        }
        let message = "ross".parse::<Address>().expect_err("no sink");
        assert!(message.contains("ros2") && message.contains("can:IFACE"), "{message}");
    }
}
