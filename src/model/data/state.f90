! SPDX-License-Identifier: MIT
!> What changes while blocks move, and the record of one step.
module rockdda_model_state
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: block_state_type, step_record_type, bolt_nodes_type, liner_nodes_type, &
      n_energies, energy_names, energy, radius_of_inertia

   !> Places of the ledger in `step_record_type%energy` (theory manual, "energy ledger").
   type :: energy_enum
      integer :: kinetic = 1
      integer :: strain = 2
      integer :: gravity = 3       !! 0 at the start
      integer :: springs = 4       !! contacts, fixed points, bolts
      integer :: external = 5      !! cumulative work of loads, prescribed points, base motion
      integer :: friction = 6      !! cumulative dissipation by friction
      integer :: dissipated = 7    !! cumulative numerical and viscous dissipation
      integer :: discarded = 8     !! cumulative, by k01 and by changes of state
      integer :: geometry = 9      !! cumulative, moved configuration instead of the linearised one
      integer :: residual = 10     !! what remains
   end type energy_enum
   type(energy_enum), parameter :: energy = energy_enum()
   integer, parameter :: n_energies = 10
   character(len=*), parameter :: energy_names(n_energies) = [character(len=28) :: &
                                  'kinetic', 'strain', 'gravity', 'springs', 'external_work', 'friction', &
                                  'numerical_dissipation', 'discarded', 'geometry', 'residual']

   !> Moving blocks. Vertex numbering is that of block_system_type.
   type :: block_state_type
      integer :: step = 0                      !! accepted steps so far
      real(wp) :: time = 0
      real(wp) :: datum(2) = 0                 !! to which positions, here and in blocks and contacts, are relative
      real(wp), allocatable :: vertices(:, :)  !! (2, nv)
      real(wp), allocatable :: centroid(:, :)  !! (2, nb)
      real(wp), allocatable :: rotation(:)     !! (nb) since the start [rad]
      real(wp), allocatable :: stress(:, :)    !! (3, nb) sx sy txy, tension positive
      real(wp), allocatable :: velocity(:, :)  !! (6, nb) of (u0 v0 r0 ex ey gxy), as carried into the next step
      real(wp), allocatable :: acceleration(:, :)  !! (6, nb) of the same, of the scheme of second order
      logical :: accelerates = .false.         !! accelerations are those of this time; else they have to be found
      logical :: quiet = .false.               !! quiet boundaries no longer hold: a dynamic step has begun
      real(wp), allocatable :: quiet_force(:)  !! (springs of boundaries) that quiet ones keep
      real(wp), allocatable :: area(:)         !! (nb)
      real(wp), allocatable :: moments(:, :)   !! (3, nb) Sxx Syy Sxy about the centroid
      real(wp), allocatable :: mass(:)         !! (nb)
      logical, allocatable :: active(:)        !! (nb) not taken out, nor still to be placed
      logical, allocatable :: asleep(:)        !! (nb) at rest, and left out until something disturbs the block
      integer, allocatable :: calm(:)          !! (nb) last steps in a row in which the block hardly moved
      real(wp), allocatable :: fixed_position(:, :)    !! (2, nf) fixed points now
      real(wp), allocatable :: loading_position(:, :)  !! (2, nl)
      real(wp), allocatable :: measured_position(:, :) !! (2, nm)
      real(wp), allocatable :: measured_from(:, :)     !! (3, nm) place and rotation that displacements count from
      real(wp), allocatable :: bolt_ends(:, :)         !! (4, n_bolts) now
      real(wp), allocatable :: bolt_elongation(:)      !! (n_bolts) change of length since the start
      real(wp), allocatable :: bolt_plastic(:)         !! (n_bolts) yielded part of the elongation
   end type block_state_type

   !> Nodes of bolts, in a frame.
   type :: bolt_nodes_type
      real(wp), allocatable :: place(:, :)     !! (2, nodes) [length]
      real(wp), allocatable :: force(:)        !! (nodes) axial, tension positive
      real(wp), allocatable :: slip(:)         !! (nodes) bar against rock [length]
      real(wp), allocatable :: use(:)          !! (nodes) largest share of a strength: of the steel, of its grout
      integer, allocatable :: state(:)         !! (nodes) 0 absent, 1 elastic, 2 slipping, 3 yielding, 4 ruptured
   end type bolt_nodes_type

   !> Nodes of linings, in a frame.
   type :: liner_nodes_type
      real(wp), allocatable :: place(:, :)     !! (2, nodes) [length]
      real(wp), allocatable :: force(:, :)     !! (3, nodes) N tension positive, M pulling on the side of the opening, Q
      real(wp), allocatable :: sides(:, :)     !! (4, nodes) N, Q before the node, N, Q behind it: at a corner two
      real(wp), allocatable :: back(:, :)      !! (2, nodes) largest opening and slip of its back [length]
      real(wp), allocatable :: section(:, :)   !! (6, nodes) N, M by which sections are judged: at the start, in the
                                               !! middle and at the end of the beam that begins at the node
      real(wp), allocatable :: use(:)          !! (nodes) largest share of the strength that N and M take together, of
                                               !! the node and of the sections beside it; below 0: it has no strength
      integer, allocatable :: state(:)         !! (nodes) 0 absent, 1 sound, 2 cracked, 3 crushed
   end type liner_nodes_type

   !> What the history keeps of one accepted step.
   type :: step_record_type
      integer :: step = 0
      real(wp) :: time = 0                     !! at the end of the step
      real(wp) :: dt = 0
      integer :: open_close_iterations = 0     !! of the accepted attempt
      integer :: attempts = 0                  !! 1 when the first one was accepted
      integer :: solver_iterations = 0         !! summed over all solves of the step
      integer :: contacts(3) = 0               !! open, sliding, locked
      real(wp) :: max_displacement = 0         !! largest vertex displacement of the step
      real(wp) :: unbalanced = 0               !! largest resultant force on a block over the mean force
      integer :: stage = 0                     !! from 0
      real(wp) :: time_error = 0               !! estimated error in time over the largest displacement
      real(wp) :: relaxation = 0               !! released share of the forces of the last excavation
      real(wp) :: energy(n_energies) = 0
      real(wp), allocatable :: measured_displacement(:, :) !! (2, nm) since the start
      real(wp), allocatable :: measured_stress(:, :)       !! (3, nm) of the block with the point
      real(wp), allocatable :: measured_rotation(:)        !! (nm)
      real(wp), allocatable :: fixed_force(:, :)           !! (2, nf) of the support on the block
      real(wp), allocatable :: boundary_force(:, :)        !! (2, boundaries) on the blocks
      real(wp), allocatable :: bolt_force(:)               !! (bolts) largest along the bolt, where bolts have nodes
      real(wp), allocatable :: bolt_head_force(:)          !! (bolts)
      real(wp), allocatable :: bolt_dowel(:)               !! (bolts) largest
      real(wp) :: bolt_energy(4) = 0                       !! stored, slipped, yielded, set free by breaking
   end type step_record_type

contains

   !> Radius of inertia of block i about its centroid [length].
   pure real(wp) function radius_of_inertia(state, i)
      type(block_state_type), intent(in) :: state
      integer, intent(in) :: i
      radius_of_inertia = sqrt((state%moments(1, i) + state%moments(2, i))/state%area(i))
   end function radius_of_inertia

end module rockdda_model_state
