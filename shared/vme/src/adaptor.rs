//! Bus adaptors: a VME–VME pair (Bit3 413 class) and the VME–GIO one.
//!
//! Seen from this chassis an adaptor is a card with two faces. As a *slave* its windows lead to the
//! remote bus, whose time is the window's response time ([`crate::rack::Slave::adaptor`]). As a
//! *master* it carries the accesses of a workstation: single accesses pay the link on the way in and
//! out, block transfers a DMA set-up and then the link's rate. Without a link both faces fail with
//! BERR*: windows do not answer, and a workstation's access ends in its adaptor after a time-out. A workstation reaches
//! what the adaptor maps into its own bus ([`Map`]); an access beside that ends in the adaptor too. The link checks parity:
//! a transfer that fails the check ([`crate::FaultKind::Parity`]) ends in BERR*.

use crate::Ns;
use crate::program::Access;
use crate::requester::ReleasePolicy;
use serde::{Deserialize, Serialize};

/// Which bus lies beyond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Another VMEbus (a Sun workstation).
    #[default]
    #[serde(rename = "VME-VME")]
    VmeVme,
    /// The GIO bus of an SGI workstation.
    #[serde(rename = "VME-GIO")]
    VmeGio,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Kind::VmeVme => "VME–VME",
            Kind::VmeGio => "VME–GIO",
        })
    }
}

/// An adaptor card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adaptor {
    /// Card name, for example `vme-vme`.
    pub name: String,
    /// Which bus lies beyond.
    #[serde(default)]
    pub kind: Kind,
    /// Slot, 1 to 21.
    pub slot: u8,
    /// Bus request level, 0 to 3.
    #[serde(default)]
    pub level: u8,
    /// When its requester leaves the bus.
    #[serde(default)]
    pub release: ReleasePolicy,
    /// Link time of a single read, both ways together (remote access 2–3 µs in all, A; GIO 2–4 µs, C).
    #[serde(default = "link_read_ns")]
    pub link_read_ns: Ns,
    /// Link time of a single write, both ways together (GIO 1–2 µs in all, C).
    #[serde(default = "link_write_ns")]
    pub link_write_ns: Ns,
    /// Set-up of the DMA engine before a block transfer (14–35 µs, A).
    #[serde(default = "dma_setup_ns")]
    pub dma_setup_ns: Ns,
    /// Rate of the link in a block transfer (12–26 MB/s, A).
    #[serde(default = "dma_bytes_per_s")]
    pub dma_bytes_per_s: u64,
    /// The workstation's access ends in error after this time where the link is down.
    #[serde(default = "link_timeout_ns")]
    pub link_timeout_ns: Ns,
    /// Whether the cable is plugged in.
    #[serde(default = "yes")]
    pub link: bool,
    /// What the workstation sees of this bus; nothing stated: all of it, at the same addresses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub maps: Vec<Map>,
}

/// A part of this bus as the workstation sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// First byte address on the workstation's bus.
    pub remote_base: u32,
    /// First byte address on this bus.
    pub base: u32,
    /// Bytes.
    pub size: u32,
}

fn link_read_ns() -> Ns {
    1_900
}
fn link_write_ns() -> Ns {
    1_200
}
fn dma_setup_ns() -> Ns {
    20_000
}
fn dma_bytes_per_s() -> u64 {
    20_000_000
}
fn link_timeout_ns() -> Ns {
    10_000
}
fn yes() -> bool {
    true
}

impl Adaptor {
    /// An adaptor with a Bit3 413 class link, in this slot.
    pub fn new(name: &str, kind: Kind, slot: u8) -> Adaptor {
        Adaptor {
            name: name.into(),
            kind,
            slot,
            level: 0,
            release: ReleasePolicy::OnRequest,
            link_read_ns: link_read_ns(),
            link_write_ns: link_write_ns(),
            dma_setup_ns: dma_setup_ns(),
            dma_bytes_per_s: dma_bytes_per_s(),
            link_timeout_ns: link_timeout_ns(),
            link: true,
            maps: Vec::new(),
        }
    }

    /// Whether the workstation's access lies in what is mapped.
    pub fn reaches(&self, access: &Access) -> bool {
        let end = u64::from(access.addr) + u64::from(access.n.max(1)) * u64::from(access.width.bytes());
        let holds = |map: &Map| access.addr >= map.base && end <= u64::from(map.base) + u64::from(map.size);
        self.maps.is_empty() || self.maps.iter().any(holds)
    }

    /// Time that the link needs for `bytes` of a block transfer, rounded up.
    pub fn pace_ns(&self, bytes: u32) -> Ns {
        (Ns::from(bytes) * crate::SECOND).div_ceil(self.dma_bytes_per_s.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_workstation_reaches_what_is_mapped_and_nothing_beside_it() {
        let mut adaptor = Adaptor::new("vme-vme", Kind::VmeVme, 18);
        let access = |addr, n| Access { am: 0x3D, addr, width: crate::Width::D32, dir: crate::Direction::Read, n };
        assert!(adaptor.reaches(&access(0x0, 1)));
        adaptor.maps.push(Map { remote_base: 0xF000_0000, base: 0x40_0000, size: 0x1_0000 });
        assert!(adaptor.reaches(&access(0x40_0000, 0x4000)));
        assert!(!adaptor.reaches(&access(0x40_0000, 0x4001)) && !adaptor.reaches(&access(0x3F_FFFC, 1)));
    }

    #[test]
    fn a_long_dma_approaches_the_links_rate() {
        let adaptor = Adaptor::new("vme-vme", Kind::VmeVme, 18);
        assert_eq!(adaptor.pace_ns(4), 200);
        assert_eq!(adaptor.pace_ns(1), 50);
    }
}
