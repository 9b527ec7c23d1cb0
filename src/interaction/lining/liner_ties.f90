! SPDX-License-Identifier: MIT
!> Points at which the back of a lining is held to the rock, or to the lining on which it lies: their law.
!>
!> A point represents a length of the back. Its gap, positive open, and its shear displacement count from its
!> installation, when it is closed and free of stress. A bond is elastic in both directions. With a joint material it
!> opens at the tensile strength of the joint, none unless given, and slides at its shear strength
!> (rockdda_interaction_joint_strength). Forces are continuous where it opens and closes: within a step a point that
!> opens keeps its strength, and has come off for the next one; in the step in which it closes it has no tensile
!> strength, and of its cohesion no more than `closing` times the normal force. From then on it is a contact that
!> has closed again.
module rockdda_interaction_liner_ties
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_joint_strength, only : joint_law_type, cohesion_at, shear_strength, tension_at
   implicit none
   private
   public :: tie_type, tie_after_type, tie_response_type, tie_state, respond_tie

   real(wp), parameter :: closing = 3.0_wp

   type :: tie_state_enum
      integer :: open = 0
      integer :: held = 1       !! stiff in both directions
      integer :: slides = 2
      integer :: at_tension = 3 !! at the tensile strength
      integer :: parts = 4      !! at the tensile and the shear strength
   end type tie_state_enum
   type(tie_state_enum), parameter :: tie_state = tie_state_enum()

   !> The state of a tie that changes at the end of a step.
   type :: tie_after_type
      real(wp) :: free(2) = 0
      real(wp) :: slip = 0
      logical :: bonded = .true.
      logical :: parted = .false.
      logical :: sliding = .false.
   end type tie_after_type

   type :: tie_type
      integer :: a = 0                 !! block of the rock, or segment of the lower lining; 0: it has gone for good
      integer :: b = 0                 !! segment
      logical :: on_rock = .true.
      real(wp) :: at_a(2) = 0          !! its place in the rock now; on a segment its arm, as it was placed [length]
      real(wp) :: arm(2) = 0           !! on segment b, as it was installed [length]
      real(wp) :: angle = 0            !! of the normal from a to b then [rad]
      real(wp) :: length = 0
      real(wp) :: shape(3) = 0         !! gap by curvature, shear by strain, gap by slope of b's back [length]
      real(wp) :: motion(2) = 0        !! gap and shear displacement now [length]
      real(wp) :: bent(2) = 0          !! the part of it by the shape of b's back [length]
      real(wp) :: free(2) = 0          !! gap and shear displacement without force: of slip, and of a change of the
                                       !! stiffness under force [length]
      real(wp) :: slip = 0             !! |slip| summed up [length]
      logical :: bonded = .true.       !! it has never opened, nor, if the joint is brittle, slid
      logical :: parted = .false.      !! it has come off, and was open at the end of the last step
      logical :: sliding = .false.     !! it slid in the last step
      ! of the step
      real(wp) :: drag(2) = 0          !! dashpots over the time of the motion [force/length]
      logical :: acts = .false.
      real(wp) :: level = 1            !! share of the motion up to where its force acts
      real(wp) :: factor = 1           !! of its force in the equations
      real(wp) :: move(2) = 0, kept(2) = 0   !! change where forces act [length]
      integer :: changes = 0           !! of its state in the rounds
      integer :: state = 0             !! tie_state%..., of the last round
      real(wp) :: force(2) = 0         !! of the last round
      real(wp) :: at(2) = 0            !! its change there [length]
      real(wp) :: tangent(2) = 0       !! [force/length]
      type(tie_after_type) :: after    !! of the end of the step
   end type tie_type

   type :: tie_response_type
      integer :: state = 0             !! tie_state%...
      real(wp) :: force(2) = 0         !! pulling positive, and along the shear displacement [force]
      real(wp) :: stiffness(2) = 0     !! [force/length]
      real(wp) :: energy = 0           !! stored
      logical :: breaks = .false.      !! its bond
      real(wp) :: limit = 0            !! shear strength [force]
      real(wp) :: trial = 0            !! shear force without one
   end type tie_response_type

contains

   !> Forces of a gap and a shear displacement. Without a law it is elastic.
   pure subroutine respond_tie(tie, stiffness, motion, response, law)
      type(tie_type), intent(in) :: tie
      real(wp), intent(in) :: stiffness(2)       !! over length [force/length^2]
      real(wp), intent(in) :: motion(2)          !! since its installation [length]
      type(tie_response_type), intent(out) :: response
      type(joint_law_type), intent(in), optional :: law
      real(wp) :: k(2), limit, e(2), spring, dashpot(2)
      k = stiffness*tie%length
      e = motion - tie%free
      dashpot = tie%drag*(motion - tie%motion)
      response%state = tie_state%held
      response%force = k*e
      response%stiffness = k
      if (present(law)) then
         limit = 0
         if (.not. tie%parted) limit = tension_at(law, tie%slip, tie%bonded)*tie%length
         if (response%force(1) > limit) then
            response%energy = 0.5_wp*limit**2/k(1) + limit*(e(1) - limit/k(1))
            response%force(1) = limit
            response%stiffness(1) = 0
            response%state = tie_state%at_tension
            response%breaks = tie%bonded
            if (tie%parted .or. .not. (tie%bonded .or. limit > 0 .or. cohesion_at(law, tie%slip, .false.) > 0)) then
               response%state = tie_state%open
               response%force = 0
               response%stiffness = 0
               return
            end if
         else
            response%energy = 0.5_wp*response%force(1)*e(1)
         end if
         spring = response%force(2)
         limit = shear_strength(law, -response%force(1), tie%length, tie%bonded, 0.0_wp, tie%slip)
         if (tie%parted) limit = limit - max(0.0_wp, shear_strength(law, 0.0_wp, tie%length, tie%bonded, 0.0_wp, &
                                                                    tie%slip) + closing*response%force(1))
         response%limit = limit
         response%trial = spring + dashpot(2)
         if (abs(spring + dashpot(2)) > limit) then
            response%breaks = response%breaks .or. (tie%bonded .and. law%brittle)
            response%force(2) = sign(limit, spring + dashpot(2))
            response%stiffness(2) = 0
            response%state = merge(tie_state%slides, tie_state%parts, response%state == tie_state%held)
            dashpot(2) = 0
         else
            response%stiffness(2) = k(2) + tie%drag(2)
         end if
         response%energy = response%energy + 0.5_wp*response%force(2)**2/k(2)
         ! friction follows the spring, not its dashpot
         response%stiffness(1) = response%stiffness(1) + tie%drag(1)
         response%force = response%force + dashpot
      else
         response%energy = 0.5_wp*dot_product(response%force, e)
      end if
   end subroutine respond_tie

end module rockdda_interaction_liner_ties
